"""Pebble as the tracker asks it: what it can do, and a scene in its own terms."""

import numpy as np

from spook_tracker.engine import Distance
from spook_tracker.engine.stepped import Capabilities, Configuration, Stepped
from tracking import pebble


class Pebble(Stepped):
    name = "pebble"
    capabilities = Capabilities(joints=frozenset({Distance}), rigid_bodies=False)
    configurations = (
        Configuration(name="default", reason="as we ship it: 50 iterations", expected_order=1.0),
    )

    def world(self, task):
        world = pebble.World(task.scene.gravity, task.time_step, iterations=50)
        places = {body.name: world.add(body.position, body.velocity, body.mass) for body in task.scene.bodies}
        for rod in task.scene.constraints:
            ends = [places[end] if isinstance(end, str) else world.add(end) for end in rod.between]
            world.join(*ends, rod.rest_length or float(np.linalg.norm(np.subtract(*world.at(ends)))))
        world.shown = len(places)
        return world


ENGINE = Pebble(checkout=__file__)
