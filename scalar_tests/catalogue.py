"""Every scalar test by name: the table that `tracker run` goes through. A new test is a file and a line here."""

from __future__ import annotations

from spook_tracker.scalar_tests import (
    beam,
    bouncing_ball,
    cantilever,
    door,
    falling_object,
    force_ratio,
    friction,
    hanging_chain,
    lock_ring,
    motor,
    n_pendulum,
    oscillator_damped,
    oscillator_filter,
    oscillator_row,
    oscillator_spring,
    pendulum,
    planetarium,
    resting_stack,
    rolling_sphere,
    rotating_box,
    slip_angle,
    spinning_top,
    swinging_door,
)
from spook_tracker.scalar_tests.case import ScalarTest

CATALOGUE: dict[str, ScalarTest] = {
    # the thesis' seven continuous tests, in its order
    "beam": beam.TEST,
    "door": door.TEST,
    "falling_object": falling_object.TEST,
    "friction": friction.TEST,
    "pendulum": pendulum.TEST,
    "n_pendulum": n_pendulum.TEST,
    "planetarium": planetarium.TEST,
    # its other studies
    "cantilever": cantilever.TEST,
    "slip_angle": slip_angle.TEST,
    "force_ratio": force_ratio.TEST,
    "oscillator_spring": oscillator_spring.TEST,
    "oscillator_row": oscillator_row.TEST,
    "oscillator_damped": oscillator_damped.TEST,
    "oscillator_filter": oscillator_filter.TEST,
    # what it asks for next
    "bouncing_ball": bouncing_ball.TEST,
    "rotating_box": rotating_box.TEST,
    "swinging_door": swinging_door.TEST,
    "lock_ring": lock_ring.TEST,
    "resting_stack": resting_stack.TEST,
    "rolling_sphere": rolling_sphere.TEST,
    "hanging_chain": hanging_chain.TEST,
    "spinning_top": spinning_top.TEST,
    "motor": motor.TEST,
}
