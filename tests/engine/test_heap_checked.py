"""Where a solve falls back on another, neither writes beyond its room: asked of the C library, which looks at each block."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

# Two bodies on a hinge of no place: 7 coordinates, 5 rows. Whirled round, joint coordinates find nothing in a stage, nor do
# the rows: the step is halved.
WHIRLED = """
from spook_tracker.engine import Capsule, Hinge, Method, RigidBody, Scene, compile
a = RigidBody(name="a", mass=0.5, shape=Capsule(radius=0.45, length=0.45), position=(0.0, 0.0, 0.0),
              angular_velocity=(0.0, -1.5, -0.6))
b = RigidBody(name="b", mass=5.4, shape=Capsule(radius=0.21, length=0.21), position=(-0.2, 4.0, 1.0),
              velocity=(4.0, 3.0, 0.5), angular_velocity=(22.0, 61.0, 58.0))
hinge = Hinge(name="hinge", between=("b", "a"), at=(-0.1, 2.0, 0.5), axis=(0.63, -0.52, 0.58), compliance=0.0,
              damping=None)
scene = Scene(bodies=(a, b), constraints=(hinge,), contacts=False)
program = compile(scene, time_step=0.05, method=Method(composition="order6"))
print(program.run(1).counters["halved_steps"] > 0)
del program
"""


@pytest.mark.skipif(sys.platform != "linux", reason="asks the GNU C library")
def test_rows_of_a_floating_tree_are_solved_in_their_own_room() -> None:
    done = subprocess.run(
        [sys.executable, "-c", WHIRLED], capture_output=True, text=True, check=False,
        env={**os.environ, "LD_PRELOAD": "libc_malloc_debug.so.0", "MALLOC_CHECK_": "3"},
    )  # fmt: skip

    assert "cannot be preloaded" not in done.stderr
    assert (done.returncode, done.stdout) == (0, "True\n"), done.stderr
