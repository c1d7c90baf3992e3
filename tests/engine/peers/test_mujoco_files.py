"""Model files in MuJoCo: what is read is what a hand calculation gives, rounding is told from change, chaos as chaos."""

from __future__ import annotations

import itertools
import math
import pickle
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.find import find
from spook_tracker.engine.method import PLAIN
from spook_tracker.engine.model_file import Drive, ModelFile, ModelRun, Watched
from spook_tracker.engine.model_reading import read
from spook_tracker.engine.peers.mujoco_file import load
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.result import Result, SimulationFailed
from spook_tracker.scalar_tests.model_file import books, cost, ladder, motion, rest
from spook_tracker.scalar_tests.model_file.facts import Asked, turns
from spook_tracker.tracker.measure import remembered
from spook_tracker.tracker.measure.model_motion import model_trajectory
from spook_tracker.tracker.measure.trajectory import values_of

pytest.importorskip("mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'")

BOX = """<mujoco><worldbody><geom type="plane" size="2 2 .1"/>
<body name="lower" pos="0 0 .25"><geom type="box" size=".25 .25 .25"/></body>
<body name="box" pos="0 0 .75"><freejoint/><geom type="box" size=".25 .25 .25" mass="1"/></body></worldbody></mujoco>"""
FALL = '<mujoco><worldbody><body name="ball"><freejoint/><geom size=".1"/></body></worldbody></mujoco>'
SPIN = """<mujoco><option gravity="0 0 0"/><worldbody><body name="wheel"><joint name="axle" axis="0 0 1"/>
<geom type="cylinder" size=".1 .1" mass="1"/></body></worldbody>
<actuator><{actuator} joint="axle" {more}/></actuator><keyframe><key name="off" qpos=".5"/></keyframe></mujoco>"""
DOUBLE = """<mujoco><option integrator="RK4"/><worldbody><body name="upper"><joint axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/><body name="lower" pos=".3 0 0"><joint axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body></body></worldbody></mujoco>"""


def _model(folder: Path, text: str, **facts) -> ModelFile:
    file = folder / "model.xml"
    file.write_text(text)
    found = read(file)
    return ModelFile(
        path=str(file), format=found.format, digest=found.digest, time_step=found.time_step, watched=found.watched, **facts
    )  # fmt: skip


@cache
def _simulate():
    return find("mujoco").simulate


def _run(model: ModelFile, duration: float, **asked):
    return _simulate()(ModelRun(model=model, **asked), time_step=model.time_step, duration=duration)


def test_a_free_fall_is_that_of_semi_implicit_euler(tmp_path: Path) -> None:
    model = _model(tmp_path, FALL)

    found = _run(model, 1.0, samples=(0.5, 1.0))["position"][:, 0, 2]

    assert found == pytest.approx([-0.5 * 9.81 * t * (t + 0.002) for t in (0.5, 1.0)], abs=1e-12)


def test_a_box_on_a_box_rests_carried_by_its_contacts(tmp_path: Path) -> None:
    asked = Asked(model=_model(tmp_path, BOX), duration=1.0)

    found = rest.measure(asked, _simulate())

    assert found["load"] == pytest.approx(1.0, abs=1e-3)
    assert 0.75 - found["box.rest_z"] == pytest.approx(
        found["overlap"], rel=1e-3
    )  # four corners, equally deep
    assert 1e-6 < found["overlap"] < 1e-3
    assert found["box.rest_z"].unsettled == ""
    assert found["settled"] < 1.0


def test_what_never_rests_is_said_to_be_unsettled(tmp_path: Path) -> None:
    """And is run once: there is no rest that pushes or steps could move."""
    runs = []
    counted = lambda *asked, **how: runs.append(asked) or _simulate()(*asked, **how)  # noqa: E731
    found = rest.measure(Asked(model=_model(tmp_path, FALL), duration=1.0), counted)

    assert "still moves at" in found["ball.rest_z"].unsettled
    assert (len(runs), found["ball.rest_z"].rounding) == (1, math.inf)


def test_what_stands_on_its_head_for_a_while_does_not_rest_there(tmp_path: Path) -> None:
    """It begins slower than what counts as rest, for more than half a second: 1e-5 rad grow to 1e-4 by then. Then it falls."""
    standing = """<mujoco><worldbody><body name="rod" pos="0 0 1" euler="0 .0006 0"><joint axis="0 1 0" damping="2"/>
    <geom type="capsule" fromto="0 0 0 0 0 1" size=".02" mass="1"/></body></worldbody></mujoco>"""
    found = rest.measure(Asked(model=_model(tmp_path, standing), duration=5.0), _simulate())

    assert found["rod.rest_turn"] == pytest.approx(math.pi, abs=1e-3)
    assert 1.0 < found["settled"] < 10.0


def test_motion_and_rest_are_read_off_the_same_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One as the file has it, four with pushes, one with half the step; the second question makes none of its own."""
    monkeypatch.setattr(remembered, "WORTH", 0.0)
    made: list[ModelRun] = []
    simulate = remembered.Remembered(
        lambda run, **how: made.append(run) or _simulate()(run, **how), scenes=False
    )
    asked = Asked(model=_model(tmp_path, BOX), duration=1.0)

    moved, rests = motion.measure(asked, simulate), rest.measure(asked, simulate)

    assert [run.seed for run in made] == [0, 1, 2, 3, 4, 0]
    assert 0.75 - rests["box.rest_z"] == pytest.approx(moved["box.place@1s"], abs=1e-9)


def test_the_step_error_of_a_fall_is_half_its_error(tmp_path: Path) -> None:
    found = motion.measure(Asked(model=_model(tmp_path, FALL), duration=1.0), _simulate())
    place = found["ball.place@1s"]

    assert place.step_error == pytest.approx(
        0.5 * 9.81 * 1.0 * 0.001, rel=1e-9
    )  # ½ g t h, once with h and once with h/2
    assert 1e-15 * 0.2 <= place.rounding < 1e-11
    assert found["predictable_time"] == 1.0


def test_a_double_pendulum_can_be_predicted_for_some_time_only(tmp_path: Path) -> None:
    """Pushes of 1e-15 must grow 1e13-fold: at the double pendulum's exponent, some 5 to 9 a second here, within 10 s."""

    class Longer(Asked):
        checkpoints = (1.0, 20.0)

    ends: dict[int, np.ndarray] = {}  # of the lower body, m, by seed

    def seen(run: ModelRun, **how: float) -> Result:
        result = _simulate()(run, **how)
        ends[run.seed] = result["position"][-1, 0]
        return result

    model = _model(tmp_path, DOUBLE)
    found = motion.measure(Longer(model=model, duration=20.0), seen)
    start = _run(model, 0.1, samples=(0.0,))["position"][0, 0]
    drawn = [np.linalg.norm(end - start) for seed, end in ends.items() if seed]

    assert 1.0 < found["predictable_time"] < 20.0
    assert found["lower.place@1s"].rounding < 1e-9
    assert math.isinf(found["lower.place@20s"].rounding)
    assert 0.05 < found["lower.mean_place"].rounding < 2.0  # of a distribution: by chance, and by no more
    assert found["lower.mean_place"].unsettled == ""
    assert len(drawn) == 16 and found["lower.mean_place"] == pytest.approx(np.mean(drawn), rel=1e-12)


def test_means_of_chaotic_runs_differ_by_chance_alone_and_a_shift_is_seen() -> None:
    """Draws from one distribution, flat, normal or of two heaps, never look changed; six spreads further they always do."""
    random = np.random.default_rng(1)
    draws = {
        "flat": lambda: random.uniform(0.0, 1.0, 16),
        "normal": lambda: random.normal(2.0, 0.3, 16),
        "two heaps": lambda: random.choice([0.0, 1.0], 16) + random.normal(0.0, 0.01, 16),
    }
    for draw in draws.values():
        spread = float(np.std([draw() for _ in range(100)]))
        for _ in range(2000):
            before, after = motion.mean_of(draw(), 1.0, True), motion.mean_of(draw(), 1.0, True)
            allowed = max(before.rounding, after.rounding)
            assert abs(after - before) <= allowed
            assert abs(after + 6.0 * spread - before) > allowed


def test_pushes_move_it_and_the_same_seed_moves_it_the_same(tmp_path: Path) -> None:
    model = _model(tmp_path, DOUBLE)
    still, one, again, two = (
        _run(model, 0.5, **push)
        for push in ({}, {"push": 1e-15, "seed": 1}, {"push": 1e-15, "seed": 1}, {"push": 1e-15, "seed": 2})
    )

    assert one.state_hash == again.state_hash
    assert len({still.state_hash, one.state_hash, two.state_hash}) == 3
    assert np.abs(still["position"] - one["position"]).max() < 1e-12


def test_a_model_answers_with_the_same_bits_in_another_process(tmp_path: Path) -> None:
    asked = Asked(model=_model(tmp_path, BOX), duration=0.2)

    assert cost.repeatability(asked, _simulate()) == {"differing_runs": 0.0}


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux ends a process with its parent")
def test_a_run_elsewhere_ends_with_the_process_that_asked(tmp_path: Path) -> None:
    code = (
        "import pickle, sys; from spook_tracker.engine.find import find; "
        "run, h = pickle.load(open(sys.argv[1], 'rb')); find('mujoco').simulate(run, time_step=h, duration=1e6)"
    )
    model = _model(tmp_path, BOX)
    (tmp_path / "asked").write_bytes(pickle.dumps((ModelRun(model=model, elsewhere=True), model.time_step)))
    parent = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "asked")])
    children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")

    def at_work() -> str:
        for child in children.read_text().split():
            with suppress(OSError):
                told = Path(f"/proc/{child}/cmdline").read_text(), Path(f"/proc/{child}/maps").read_text()
                if "model_loop" in told[0] and "mujoco" in told[1]:
                    return child
        return ""

    try:
        child = _until(at_work)
    finally:
        parent.kill()
        parent.wait()

    _until(
        lambda: (
            not Path(f"/proc/{child}").exists() or "Z" in Path(f"/proc/{child}/stat").read_text().split()[2]
        )
    )


def _until(true, seconds: float = 60.0):
    """What it becomes, once it is something."""
    ends = time.monotonic() + seconds
    while not (found := true()):
        assert time.monotonic() < ends
        time.sleep(0.05)
    return found


@pytest.mark.parametrize(
    ("drive", "expected"),
    [
        (Drive(), 0.0),
        (
            Drive(kind="sinusoid", amplitude=0.01, frequency=1.0),
            0.01 / (2 * math.pi * 0.005),
        ),  # ∫∫ sin over a period
        (Drive(kind="table", rows=((0.0, 0.01), (0.5, 0.0))), 0.01 / 0.005 * (0.125 + 0.25)),
    ],
)
def test_controls_drive_it_as_a_hand_calculation_says(tmp_path: Path, drive: Drive, expected: float) -> None:
    """Inertia ½ m r² = .005 kg m² about the axle; torques of .01 N m."""
    model = _model(tmp_path, SPIN.format(actuator="motor", more=""), drive=drive)

    turned = _run(model, 1.0)["orientation"][-1, 0]

    assert 2.0 * math.atan2(turned[3], turned[0]) == pytest.approx(expected, abs=0.01 * max(expected, 0.1))


def test_to_hold_the_start_asks_servos_to_stay_at_the_keyframe(tmp_path: Path) -> None:
    servo = SPIN.format(actuator="position", more='kp="1"')
    held = _model(tmp_path, servo, keyframe="off", drive=Drive(kind="hold"))
    let_go = _model(tmp_path, servo, keyframe="off")

    angle = [2.0 * math.atan2(*_run(model, 0.1)["orientation"][-1, 0][[3, 0]]) for model in (held, let_go)]

    assert angle[0] == pytest.approx(0.5, abs=1e-12)
    assert angle[1] < 0.5


def test_meshes_of_one_name_in_two_folders_of_a_urdf_stay_two(tmp_path: Path) -> None:
    """MuJoCo tells what it is handed by the name after the last slash."""
    link = '<link name="{0}"><collision><geometry><mesh filename="package://two/{0}/link.obj"/></geometry></collision></link>'
    joint = '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{0}"/></joint>'
    links = "".join(map(link.format, "ab"))
    (tmp_path / "package.xml").write_text("")
    (tmp_path / "two.urdf").write_text(
        f'<robot name="two"><link name="base"/>{links}{joint.format("a", "base")}{joint.format("b", "a")}</robot>'
    )
    for name, size in (("a", 1.0), ("b", 4.0)):
        (tmp_path / name).mkdir()
        corners = "".join(
            f"v {size * x} {size * y} {size * z}\n"
            for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
        )
        (tmp_path / name / "link.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    found = read(tmp_path / "two.urdf")
    assets = {name: str(path) for name, path in found.assets.items()}
    model = ModelFile(
        path=str(found.path), format="URDF", digest="", time_step=0.01, watched=found.watched, assets=assets
    )

    a, b = load(ModelRun(model=model)).geom_rbound
    assert b == pytest.approx(4.0 * a)


def test_what_mujoco_refuses_or_lacks_is_not_supported_by_name(tmp_path: Path) -> None:
    with pytest.raises(NotSupported, match=r"mujoco refuses model\.xml: .*nonsense"):
        _run(_model(tmp_path, FALL.replace("<geom", "<nonsense/><geom")), 0.1)
    model = _model(tmp_path, FALL)
    with pytest.raises(NotSupported, match="no body 'tail'"):
        _run(ModelFile(path=model.path, format="MJCF", digest="", time_step=0.01, watched=(Watched(label="tail", name="tail"),)), 0.1)  # fmt: skip


def test_what_blows_up_is_diverged_though_mujoco_would_start_again(tmp_path: Path) -> None:
    stiff = SPIN.format(actuator="position", more='kp="1e9"')
    found = _run(_model(tmp_path, stiff, keyframe="off"), 1.0)

    assert found.status == "diverged"
    assert "mujoco reset a state it calls bad" in found.failure


PENDULUM = """<mujoco><option integrator="Euler" timestep=".005"/><worldbody><body name="bob"><joint axis="0 1 0" damping="1"/>
<geom type="sphere" size=".1" pos=".5 0 0" mass="1"/></body></worldbody></mujoco>"""


def test_contacts_that_are_left_out_for_lack_of_memory_are_told(tmp_path: Path) -> None:
    """MuJoCo says so in a log, and lets the box fall through the floor."""
    sizes = {
        size: BOX.replace("<worldbody>", f'<size memory="{size}"/><worldbody>', 1) for size in ("4K", "1K")
    }

    assert "for lack of memory" in _run(_model(tmp_path, sizes["4K"]), 0.5).failure
    assert not _run(_model(tmp_path, BOX), 0.5).failure
    with pytest.raises(EngineError, match=r"mujoco gives up on model\.xml: .*out of memory"):
        _run(_model(tmp_path, sizes["1K"]), 0.5)


def test_the_books_of_a_damped_pendulum_balance_without_its_damping(tmp_path: Path) -> None:
    asked = Asked(model=_model(tmp_path, PENDULUM), duration=1.0)
    found = books.measure(asked, _simulate())

    damped, free = (
        _run(asked.model, 1.0, samples=(0.0, 1.0), conservative=on)["position"] for on in (False, True)
    )
    assert abs(found["energy_drift"]) < 0.02  # of semi-implicit Euler, which neither wins nor loses for good
    assert found["energy_drift"].step_error > 1e-5
    assert damped.shape == free.shape
    turned = [_run(asked.model, 0.3, conservative=on)["orientation"][-1, 0] for on in (False, True)]
    assert turns(turned[1], np.array([1.0, 0, 0, 0])) > 1.3 * turns(turned[0], np.array([1.0, 0, 0, 0]))


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("numpy:ones_like", r"at 0 s fails: TypeError"),
        ("tests.engine.peers.test_mujoco_files:no_number", r"at 0 s gives \[nan\]; the model has 1 controls"),
        ("tests.engine.peers.test_mujoco_files:two", r"gives \[0\. 0\.\]; the model has 1 controls"),
        ("tests.engine.peers.test_mujoco_files:gone", r"there is no control .*gone"),
    ],
)
def test_a_control_function_that_controls_nothing_is_said(tmp_path: Path, function: str, said: str) -> None:
    drive = Drive(kind="function", function=function)
    model = _model(tmp_path, SPIN.format(actuator="motor", more=""), drive=drive)

    with pytest.raises(EngineError, match=said):
        _simulate()(ModelRun(model=model), time_step=0.01, duration=0.1)


def no_number(time: float, count: int) -> list[float]:
    return [math.nan] * count


def two(time: float, count: int) -> list[float]:
    return [0.0] * 2


def test_euler_falls_to_the_finest_run_with_order_one(tmp_path: Path) -> None:
    asked = Asked(model=_model(tmp_path, PENDULUM), duration=1.0)
    errors = [ladder.error(asked, _simulate(), h, PLAIN) for h in (0.02, 0.01, 0.005)]

    assert [a / b for a, b in itertools.pairwise(errors)] == pytest.approx([2.0, 2.0], abs=0.4)
    assert ladder.resolved(asked, _simulate())["resolved_time"] == ladder.LASTS


def test_finest_runs_that_break_off_resolve_no_further(tmp_path: Path) -> None:
    """They agree as far as the longer steps come, to .1 s: that is no agreement at .2 s, and no reference at .5 s."""
    asked = Asked(model=_model(tmp_path, PENDULUM), duration=1.0)

    def broken(run: ModelRun, **how: float) -> Result:
        found = _simulate()(run, **how)
        if how["time_step"] != asked.model.time_step / ladder.FINE:
            return found
        read = {
            name: found[name] if name == "size" else found[name][:2]
            for name in ("size", "position", "orientation")
        }
        return replace(found, status="diverged", failure="it broke off", observables=read)

    assert ladder.resolved(asked, broken)["resolved_time"] == 0.2
    with pytest.raises(SimulationFailed, match="broke off"):
        ladder.error(asked, broken, 0.01, PLAIN)


def test_the_longest_step_of_an_oscillator_is_that_of_semi_implicit_euler(tmp_path: Path) -> None:
    """h ω < 2: with 100 rad/s and .001 s twenty times the step; near it the swing grows beyond all reach."""
    spring = """<mujoco><option gravity="0 0 0" timestep=".001" integrator="Euler"/><worldbody><body name="mass">
<joint type="slide" axis="1 0 0" stiffness="10000" springref=".1"/><geom type="sphere" size=".1" mass="1"/></body></worldbody></mujoco>"""
    found = ladder.longest_step(Asked(model=_model(tmp_path, spring), duration=2.0), _simulate())

    assert found.value == pytest.approx(20.0, rel=0.15)
    assert found.resolution <= ladder.BRACKET


def test_gains_of_what_has_no_servos_are_not_asked(tmp_path: Path) -> None:
    asked = Asked(model=_model(tmp_path, SPIN.format(actuator="motor", more="")), duration=0.1)

    with pytest.raises(NotSupported, match="no position servos"):
        ladder.stiffest_gain(asked, _simulate())


SEEN = """<mujoco><asset><mesh name="wedge" vertex="0 0 0 .2 0 0 0 .2 0 0 0 .2"/></asset><worldbody>
<geom type="plane" size="1 1 1"/><body name="ball" pos="0 0 2"><freejoint/><geom size=".1"/><geom group="3" size=".5"/>
<geom type="mesh" mesh="wedge"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("engine", ["mujoco", "spook"])
def test_a_replay_shows_shapes_where_the_engine_moves_them(tmp_path: Path, engine: str) -> None:
    """A sphere and a mesh of four corners that fall for half a second; what its viewer hides is left out."""
    asked = Asked(model=_model(tmp_path, SEEN), duration=0.5)

    found = model_trajectory("seen", motion.seen(asked), find(engine).simulate)

    assert found is not None
    places = values_of(found.channels[0], found.count).reshape(found.count, found.bodies, 3)
    time_step, body = asked.model.time_step, found.body_of_solid[1]
    times = found.step * np.arange(found.count)
    assert [(one.kind, one.fixed) for one in found.solids] == [
        ("plane", True),
        ("sphere", False),
        ("facets", False),
    ]
    assert found.solids[1].size == (0.1,) and len(found.solids[2].size) == 4 * 10
    assert places[:, body, 2] == pytest.approx(2.0 - 0.5 * 9.81 * times * (times + time_step), abs=1e-4)


def test_turns_are_angles_whatever_the_sign_of_the_quaternion() -> None:
    start = np.array([math.cos(0.3), 0.0, 0.0, math.sin(0.3)])
    later = np.array([math.cos(0.5), 0.0, 0.0, math.sin(0.5)])

    assert turns(later, start) == pytest.approx(0.4, abs=1e-15)
    assert turns(-later, start) == pytest.approx(0.4, abs=1e-15)


@pytest.mark.parametrize("ratio", [0.15, 0.5, 1.0])
def test_a_contact_rebounds_as_a_damped_spring_that_never_pulls_and_a_rigid_one_does_not(
    tmp_path: Path, ratio: float
) -> None:
    """A damped half-oscillation that is let go when its force is none: by exp(-2 tan f (pi/2 - f)), sin f the damping ratio,
    exp(-2) where that is 1. At 1 m/s, without gravity, in steps of a two-hundredth of the time constant."""
    file = (
        f'<mujoco><option timestep="5e-6" gravity="0 0 0"/><default><geom solref=".001 {ratio}" solimp=".9999 .9999 .001"/></default>'
        '<worldbody><geom type="plane" size="1 1 1"/><body name="ball" pos="0 0 .11"><freejoint/><geom size=".1"/></body></worldbody>'
        '<keyframe><key name="thrown" qpos="0 0 .11 1 0 0 0" qvel="0 0 -1 0 0 0"/></keyframe></mujoco>'
    )
    model = _model(tmp_path, file, keyframe="thrown")
    angle = math.asin(ratio)
    law = math.exp(-2.0 * (math.tan(angle) * (0.5 * math.pi - angle) if ratio < 1.0 else 1.0))

    def speed(rigid: bool) -> float:
        run = find("mujoco").simulate(
            ModelRun(model=model, samples=(0.03, 0.04), rigid=rigid), time_step=5e-6, duration=0.04
        )
        return float(np.diff(run["position"][:, 0, 2])[0]) / 0.01

    assert speed(False) == pytest.approx(law, rel=0.02)
    assert (
        0.0 <= speed(True) < 0.0073
    )  # the same law at a ratio of sqrt(32): exp(-2 arccosh(r) r / sqrt(r^2 - 1))
