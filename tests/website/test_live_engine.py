"""The engine in the browser is the engine: WebAssembly in Node against the native build, bit by bit.

Each live scene is built a second time here, by the Python API. Directions that come from an angle are taken from
the page's scene (their digits are the engine's own sine's, checked against the library's to two units of the last
place); everything else is from the parameters.
"""

import base64
import itertools
import json
import math
import re
import shutil
import subprocess

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    CentralGravity,
    Distance,
    Energy,
    Lock,
    Material,
    Method,
    Orientation,
    Particle,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    simulate,
)
from tests.places import ROOT

MODULE = ROOT / "site" / "static" / "live.wasm"
STEPS = 1000
METHODS = {
    "plain": Method(),
    "curved": Method(corrections=1),
    "curved twice": Method(corrections=2),
    **{f"order {n}": Method(composition=f"order{n}") for n in (4, 6, 8)},
}


def rods(places, lengths, compliance, h):
    bodies = [Particle(name=f"{i}", position=place, mass=1.0) for i, place in enumerate(places)]
    ends = [(0.0, 0.0, 0.0), *(body.name for body in bodies)]
    return bodies, [
        Distance(name=f"rod {i}", between=pair, rest_length=length, compliance=compliance, damping=h)
        for i, (pair, length) in enumerate(zip(itertools.pairwise(ends), lengths, strict=True))
    ]


def pendulum(p, h, page):
    bob = page["start"][0]
    turn = math.radians(p["angle"])
    assert bob == pytest.approx([math.sin(turn), 0.0, -math.cos(turn)], abs=3e-16)
    bodies, links = rods([tuple(bob)], [1.0], 1e-13, h)
    return Scene(bodies=bodies, constraints=links, gravity=(0.0, 0.0, -p["gravity"])), METHODS[p["method"]]


def chain(p, h, page):
    places = [(float(i), 0.0, 0.0) for i in range(1, p["links"] + 1)]
    bodies, links = rods(places, [1.0] * len(places), float(f"1e{p['compliance']}"), h)
    return Scene(bodies=bodies, constraints=links, gravity=(0.0, 0.0, -9.81)), METHODS[p["method"]]


def oscillator(p, h, page):
    mass = Particle(name="mass", position=(0.0, 0.0, 2.0), mass=1.0)
    row = Distance(
        name="row", between=((0.0, 0.0, -64.0), "mass"), rest_length=64.0,
        compliance=1.0 / p["stiffness"], damping=p["damping"] * h,
    )  # fmt: skip
    return Scene(bodies=(mass,), constraints=(row,)), Method()


def planetarium(p, h, page):
    planet = Particle(name="planet", position=(1.0, 0.0, 0.0), velocity=(0.0, p["speed"], 0.0), mass=1.0)
    return Scene(bodies=(planet,), forces=(CentralGravity(name="sun", strength=1.0),)), METHODS[p["method"]]


def edge(p, h, page):
    places = [(float(i), 0.0, 0.0) for i in range(1, p["links"] + 1)]
    bodies, links = rods(places, [1.0] * len(places), float(f"1e{p['compliance']}"), p["damping"] * h)
    return Scene(bodies=bodies, constraints=links, gravity=(0.0, 0.0, -9.81)), Method()


def ground(surface):
    return RigidBody(name="plane", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=surface)


def slope(p, h, page):
    tilt, along = math.radians(p["angle"]), math.radians(p["direction"])
    pull = [
        -10 * math.sin(tilt) * math.cos(along),
        -10 * math.sin(tilt) * math.sin(along),
        -10 * math.cos(tilt),
    ]
    assert page["gravity"] == pytest.approx(pull, abs=4e-15)
    rough = Material(friction=p["mu"])
    box = RigidBody(
        name="box", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.0, 0.0, 0.5), material=rough
    )
    return Scene(bodies=(ground(rough), box), gravity=tuple(page["gravity"])), Method(friction=p["friction"])


def beam(p, h, page):
    boxes = [
        RigidBody(name=f"{i}", mass=2.5, shape=Box((0.125, 0.1, 0.1)), position=(0.125 * (i + 0.5), 0.0, 0.5))
        for i in range(p["boxes"])
    ]
    names = [WORLD, *(box.name for box in boxes)]
    locks = [
        Lock(name=f"lock {i}", between=(names[i], names[i + 1]), at=(0.125 * i, 0.0, 0.5),
             compliance=float(f"1e{p['compliance']}"))
        for i in range(p["boxes"])
    ]  # fmt: skip
    return Scene(bodies=boxes, constraints=locks, gravity=(0.0, 0.0, -9.81)), Method()


def pile(p, h, page):
    surface = Material(friction=p["mu"], restitution=p["restitution"])
    bodies = [ground(surface)]
    for i in range(p["count"]):
        place = (0.3 * ((i * 7) % 5 - 2) / 2, 0.3 * ((i * 3) % 5 - 2) / 2, 0.6 + 0.75 * i)
        shape = Sphere(0.3) if i % 3 == 2 else Box((0.6, 0.5, 0.4))
        turn = (0.0, 0.0, 0.0) if i % 3 == 2 else (0.0, 0.0, 0.5)
        bodies.append(
            RigidBody(
                name=f"{i}", mass=1.0, shape=shape, position=place, angular_velocity=turn, material=surface
            )
        )
    stated = {"residual_tolerance": 1e-10, "unsettled_residual": 0.1}  # m/s, by the page for every scene
    return (
        Scene(bodies=bodies, gravity=(0.0, 0.0, -9.81)),
        Method(friction=p["friction"], solver=p["solver"], **stated),
    )


CASES = [
    (pendulum, {"method": "plain", "rate": 60, "angle": 90, "gravity": 9.81}),
    (pendulum, {"method": "curved", "rate": 60, "angle": 130, "gravity": 9.81}),
    (pendulum, {"method": "curved twice", "rate": 240, "angle": 45, "gravity": 3.7}),
    (chain, {"method": "plain", "rate": 60, "links": 26, "compliance": -12}),
    (chain, {"method": "order 4", "rate": 60, "links": 26, "compliance": -12}),
    (slope, {"friction": "cone", "rate": 60, "angle": 20, "direction": 0, "mu": 0.5}),
    (slope, {"friction": "cone", "rate": 60, "angle": 40, "direction": 35, "mu": 0.5}),
    (slope, {"friction": "scaled_box", "rate": 60, "angle": 35, "direction": 25, "mu": 0.4}),
    (slope, {"friction": "box", "rate": 120, "angle": 35, "direction": 60, "mu": 0.3}),
    (oscillator, {"rate": 60, "stiffness": 50, "damping": 0}),
    (oscillator, {"rate": 60, "stiffness": 200, "damping": 2.25}),
    (edge, {"rate": 30, "damping": 0, "compliance": -13, "links": 3}),
    (edge, {"rate": 30, "damping": 0.1, "compliance": -13, "links": 3}),
    (planetarium, {"method": "plain", "rate": 60, "speed": 0.8}),
    (planetarium, {"method": "order 6", "rate": 30, "speed": 0.7}),
    (chain, {"method": "order 6", "rate": 60, "links": 5, "compliance": -9}),
    (planetarium, {"method": "order 8", "rate": 20, "speed": 1.1}),
    (beam, {"rate": 60, "boxes": 12, "compliance": -4}),
    (pile, {"friction": "cone", "solver": "direct", "rate": 60, "count": 3, "mu": 0.4, "restitution": 0.1}),
    (pile, {"friction": "scaled_box", "solver": "iterative", "rate": 120, "count": 7, "mu": 0.6, "restitution": 0.0}),
    (pile, {"friction": "cone", "solver": "iterative", "rate": 60, "count": 10, "mu": 0.4, "restitution": 0.1}),
    (pile, {"friction": "cone", "solver": "iterative", "rate": 60, "count": 10, "mu": 0.4, "restitution": 0.5}),
]  # fmt: skip


@pytest.fixture(scope="module")
def answers():
    missing = None
    if shutil.which("node") is None:
        missing = "no Node here; .ci/install-system installs it"
    elif not MODULE.exists():
        missing = "the WebAssembly module is not built: make wasm"
    if missing:
        pytest.skip(missing)
    asked = [{"scene": build.__name__, "parameters": p, "steps": STEPS} for build, p in CASES]
    asked.append({"scene": "pendulum", "parameters": {"rate": 480, "angle": 60}, "steps": 1, "order": True})
    asked.append(
        {"scene": "planetarium", "parameters": {"method": "order 4", "rate": 20}, "steps": 1, "order": True}
    )
    asked.append({"scene": "pendulum", "parameters": {}, "steps": 1, "order": True})
    command = [
        "node",
        str(ROOT / "tests" / "website" / "live_in_node.js"),
        str(ROOT / "site" / "static" / "live-engine.js"),
        str(MODULE),
    ]
    done = subprocess.run(command, input=json.dumps(asked), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    "case", range(len(CASES)), ids=[f"{b.__name__}-{i}" for i, (b, _) in enumerate(CASES)]
)
def test_every_sample_of_a_thousand_steps_has_the_same_bits(answers, case):
    """Positions, orientations of rigid bodies and energy."""
    build, parameters = CASES[case]
    page = answers[case]
    h = 1.0 / parameters["rate"]
    scene, method = build(parameters, h, page)

    turning = any(isinstance(body, RigidBody) for body in scene.bodies)
    asked = {"position": Position(), "energy": Energy()} | ({"orientation": Orientation()} if turning else {})
    observe = {name: Trace(quantity=quantity) for name, quantity in asked.items()}

    native = simulate(scene, time_step=h, steps=STEPS, method=method, observe=observe)

    assert page["status"] == native.status
    assert page["hash"] == native.state_hash
    assert (page["orientation"] is not None) == turning
    for name in asked:
        here = np.frombuffer(base64.b64decode(page[name]), dtype="<f8")
        assert np.array_equal(here.view("<u8"), np.asarray(native.partial[name]).ravel().view("<u8"))
    assert np.ptp(np.asarray(native.partial["position"]), axis=0).max() > 0.0 or build is slope


def test_friction_over_normal_force_is_what_coulomb_says(answers):
    """The tangent of the slope while the box stands, mu where it slides: closed forms, for the cone in any direction."""
    stood, slid = 0, 0
    for (build, p), page in zip(CASES, answers, strict=False):
        if build is not slope or p["friction"] != "cone":
            continue
        ratio = np.array(page["ratio"][1:], dtype=float)
        slope_of_it = math.tan(math.radians(p["angle"]))
        slides = slope_of_it > p["mu"]
        stood, slid = stood + (not slides), slid + slides
        assert page["ratio"][0] is None, "no step has ended yet"
        np.testing.assert_allclose(ratio[1:], min(slope_of_it, p["mu"]), rtol=1e-9)
    assert stood and slid


def test_energy_counts_what_a_spring_has_stored(answers):
    """m ω² A² / 2 = 100 J at 50 N/m and 2 m: without damping it stays, to the method's first order in ω h."""
    told = next(
        page["change"]
        for (build, p), page in zip(CASES, answers, strict=False)
        if build is oscillator and p["damping"] == 0
    )

    assert told["scale"] == pytest.approx(100.0, rel=0.02)
    assert abs(told["change"]) < math.sqrt(50.0) / 60.0 * 100.0


def test_the_edge_of_stability_lies_between_no_damping_and_a_tenth_of_a_step(answers):
    gained = [
        page["change"]["change"] for (build, _), page in zip(CASES, answers, strict=False) if build is edge
    ]

    assert not gained[0] < 1e6, "three rods of 1 kg hold 59 J"
    assert gained[1] < 5.0


def test_the_order_a_reader_sees_is_that_of_the_method(answers):
    plain, fourth = answers[len(CASES)]["order"], answers[len(CASES) + 1]["order"]

    first_seen = answers[len(CASES) + 2][
        "order"
    ]  # of the page as it opens: with large steps, near a change of sign
    assert plain == pytest.approx(1.0, abs=0.05)
    assert round(first_seen) == 1
    assert fourth == pytest.approx(4.0, abs=0.05)


def test_the_page_has_a_word_for_every_outcome():
    """By number: a word too few, and a reader sees "undefined after 240 steps"."""
    named = (ROOT / "engine" / "native" / "src" / "run" / "report.hpp").read_text()
    outcomes = re.search(r"SPOOK_NAMED_ENUM\(Status, ([^)]*)\)", named)[1].split(", ")
    page = (ROOT / "site" / "static" / "live-engine.js").read_text()

    words = json.loads(re.search(r"const STATUS = (\[.*\]);", page)[1])

    assert words == [outcome.replace("_", " ") for outcome in outcomes]
