"""Which bodies of a recorded motion the page gives an axle: those that turn about one axis all the while."""

import json
import math
import shutil
import subprocess

import pytest

from tests.places import ROOT

SCRIPT = ROOT / "site" / "static" / "scene-poses.js"
COUNT = 41
ASKED = """
const fs = require("fs");
eval(fs.readFileSync(process.argv[1], "utf8") + ";globalThis.told = axisOf;");
process.stdout.write(JSON.stringify(told(JSON.parse(fs.readFileSync(0, "utf8")), 0)));
"""

pytestmark = pytest.mark.skipif(
    shutil.which("node") is None, reason="no node here; .ci/install-system installs it"
)


def axis(orientations):
    movie = {"bodies": 1, "count": COUNT, "orientation": [c for q in orientations for c in q]}
    node = ["node", "-e", ASKED, str(SCRIPT)]
    done = subprocess.run(node, input=json.dumps(movie), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def about_z(angle):
    return [math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)]


def test_what_turns_about_one_axis_has_it_and_what_tumbles_or_stands_has_none():
    spin = [about_z(0.05 * n) for n in range(COUNT)]
    tumbling = [q if n < COUNT // 2 else [q[0], q[3], 0.0, 0.0] for n, q in enumerate(spin)]

    assert [abs(c) for c in axis(spin)] == pytest.approx([0.0, 0.0, 1.0])
    assert axis(tumbling) is None
    assert axis([about_z(0.0)] * COUNT) is None
