"""Which bodies of a recorded motion the page draws as wheels: those that roll on each other, and no others."""

import json
import math
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parent.parent / "site" / "static" / "scene-poses.js"
COUNT = 41
ASKED = """
const fs = require("fs");
eval(fs.readFileSync(process.argv[1], "utf8") + ";globalThis.told = { wheelsOf, axisOf };");
const movie = JSON.parse(fs.readFileSync(0, "utf8"));
process.stdout.write(JSON.stringify({ wheels: [...told.wheelsOf(movie)], axes: [0, 1].map((b) => told.axisOf(movie, b)) }));
"""


def movie(turns, centres, anchors):
    """Two bodies that turn about z by an angle a sample each, their centres where they are."""
    position, orientation = [], []
    for sample in range(COUNT):
        for body in range(2):
            half = 0.5 * turns[body] * sample
            position += centres(sample)[body]
            orientation += [math.cos(half), 0.0, 0.0, math.sin(half)]
    link = {"kind": "joint", "bodies": [0, 1], "anchors": anchors, "row": 0}
    return {"bodies": 2, "count": COUNT, "position": position, "orientation": orientation, "links": [link]}


def told(asked):
    node = ["node", "-e", ASKED, str(SCRIPT)]
    done = subprocess.run(node, input=json.dumps(asked), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


pytestmark = pytest.mark.skipif(
    shutil.which("node") is None, reason="no node here; .ci/install-system installs it"
)


def test_two_gears_have_teeth_in_the_proportion_of_their_radii():
    still = lambda _: ([0.0, 0.0, 0.0], [0.3, 0.0, 0.0])  # noqa: E731
    found = told(movie((0.05, -0.1), still, [[0.2, 0.0, 0.0], [-0.1, 0.0, 0.0]]))
    wheels = dict(found["wheels"])

    assert (wheels[0]["radius"], wheels[1]["radius"]) == (0.2, 0.1)
    assert wheels[0]["teeth"] == 2 * wheels[1]["teeth"]
    assert [abs(axis[2]) for axis in found["axes"]] == pytest.approx([1.0, 1.0])


def test_what_turns_as_one_or_about_no_axis_of_its_own_is_no_pair_of_wheels():
    ends = [[0.2, 0.0, 0.0], [-0.1, 0.0, 0.0]]
    bar = lambda n: ([0.0, 0.0, 0.0], [0.3 * math.cos(0.05 * n), 0.3 * math.sin(0.05 * n), 0.0])  # noqa: E731
    assert told(movie((0.05, 0.05), bar, ends))["wheels"] == []
    tumbling = movie((0.05, -0.1), lambda _: ([0.0, 0.0, 0.0], [0.3, 0.0, 0.0]), ends)
    for sample in range(COUNT // 2, COUNT):
        w, _, _, z = tumbling["orientation"][8 * sample : 8 * sample + 4]
        tumbling["orientation"][8 * sample : 8 * sample + 4] = [w, z, 0.0, 0.0]  # about x from there on
    found = told(tumbling)
    assert (found["wheels"], found["axes"][0]) == ([], None)


def test_a_hinge_is_no_pair_of_wheels_whether_it_holds_or_breaks():
    ends = [[0.2, 0.0, 0.0], [-0.1, 0.0, 0.0]]

    def held(sample):
        one, two = 0.05 * sample, -0.1 * sample
        return (
            [0.0, 0.0, 0.0],
            [0.2 * math.cos(one) + 0.1 * math.cos(two), 0.2 * math.sin(one) + 0.1 * math.sin(two), 0.0],
        )

    assert told(movie((0.05, -0.1), held, ends))["wheels"] == []
    falls = lambda sample: ([0.0, 0.0, 0.0], [0.3, 0.0, -0.01 * sample**2])  # noqa: E731
    assert told(movie((0.05, -0.1), falls, ends))["wheels"] == []
