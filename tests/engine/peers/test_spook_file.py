"""A model file in our engine does what MuJoCo says it does, and what it cannot say is refused by name and line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.find import find
from spook_tracker.engine.model_file import Drive, ModelFile, ModelRun
from spook_tracker.engine.model_reading import read
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.result import Result

mujoco = pytest.importorskip(
    "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
)
from spook_tracker.tracker.measure.model_agreement import ALIKE, agreement  # noqa: E402

LINK = '<geom type="capsule" size=".03 .2" pos=".1 .05 -.2" mass="1.2"/>'
TIP = '<body name="tip" pos="0 .1 -.4">{joints}<geom type="box" size=".05 .1 .15" pos="0 .02 -.1" mass=".7"/></body>'


def _arm(joints: str, tip: str, more: str = "") -> str:
    return (
        f'<mujoco><option timestep=".002"/><worldbody><body name="arm" pos="0 0 1">{joints}{LINK}'
        f"{TIP.format(joints=tip)}</body></worldbody>{more}</mujoco>"
    )


HINGE = '<joint name="swing" axis="0 1 0"/>'
SWINGS = {
    "hinges askew": _arm('<joint axis="1 2 0" pos=".02 0 .1"/>', '<joint axis="0 .3 1" pos="0 0 .1"/>'),
    "a slide on a hinge": _arm(HINGE, '<joint type="slide" axis="1 0 2"/>'),
    "balls": _arm('<joint type="ball"/>', '<joint type="ball" pos="0 0 .05"/>'),
    "flying": _arm("<freejoint/>", '<joint axis="1 0 0"/>'),
    "three joints in one body": _arm(
        '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint axis="0 1 0" pos=".1 0 0"/>',
        '<joint axis="1 0 0"/><joint axis="0 1 0" pos="0 0 .1"/><joint axis="0 0 1" pos="0 .1 0"/>',
    ),
    "armature": _arm(
        '<joint axis="0 1 0" armature=".3"/>',
        '<joint axis="1 0 0" armature=".05"/><joint type="slide" axis="0 1 1" armature="2"/>',
    ),
    "springs": _arm(
        '<joint axis="0 1 0" stiffness="40" springref="20"/>',
        '<joint type="slide" axis="0 0 1" stiffness="300" armature=".1" ref=".1"/>',
    ),
    "welded parts": _arm(
        HINGE,
        '<joint axis="1 0 0"/><body pos=".1 .2 0" euler="20 30 0"><geom type="ellipsoid" size=".1 .05 .02" mass=".4"/></body>',
    ),
    "inertia as given": _arm(
        HINGE,
        '<joint axis="1 0 0"/><inertial pos=".1 0 0" mass="2" fullinertia=".03 .04 .05 .003 -.002 .001"/>',
    ),
    "a motor's rotor": _arm(HINGE, HINGE.replace("swing", "elbow"), '<actuator><motor joint="elbow" gear="3"/></actuator>'),
}  # fmt: skip


def _model(
    tmp_path: Path, text: str, name: str = "model.xml", drive: Drive | None = None, keyframe: str = ""
) -> ModelFile:
    file = tmp_path / name
    file.write_text(text)
    found = read(file)
    return ModelFile(
        path=str(file), format=found.format, digest=found.digest, time_step=found.time_step, watched=found.watched,
        drive=drive or Drive(), keyframe=keyframe, gravity=found.gravity,
        assets={name: str(asset) for name, asset in found.assets.items()},
    )  # fmt: skip


def _both(model: ModelFile, lasts: float, step: float = 1e-3, **more: object) -> tuple[Result, Result, float]:
    """Ours and MuJoCo's, and how far their watched bodies end up apart [m]."""
    asked = ModelRun(model=model, samples=(lasts,), **more)  # type: ignore[arg-type]
    ours, theirs = (find(e).simulate(asked, time_step=step, duration=lasts) for e in ("spook", "mujoco"))
    return ours, theirs, float(np.abs(ours["position"] - theirs["position"]).max())


@pytest.mark.parametrize("kind", SWINGS)
def test_a_swing_is_mujocos(kind: str, tmp_path: Path) -> None:
    """To a millionth of the size after a second, by Runge-Kutta in both; ours keeps to its tolerance in steps of half a second."""
    model = _model(tmp_path, SWINGS[kind])
    found = agreement(model, "spook")
    swing = ModelRun(model=model, samples=(1.0,), swing=1.0, seed=1, accurate=True)
    long, short = (find("spook").simulate(swing, time_step=h, duration=1.0)["position"] for h in (0.5, 0.01))

    assert found.resolved
    assert found.apart < 0.1 * ALIKE
    assert np.abs(long - short).max() < 1e-8


def test_a_tendons_spring_swings_as_in_mujoco(tmp_path: Path) -> None:
    """By shorter steps of the second order, for it pulls at a light carriage."""
    tendon = '<fixed stiffness="8" springlength=".3"><joint joint="swing" coef="1"/><joint joint="elbow" coef="-.5"/></fixed>'
    text = _arm(HINGE, '<joint name="elbow" axis="1 0 0"/>', f"<tendon>{tendon}</tendon>")
    found = agreement(_model(tmp_path, text), "spook")

    assert found.resolved and found.apart < 0.1 * ALIKE


def test_urdf_is_read_as_well(tmp_path: Path) -> None:
    link = '<inertial><mass value="1"/><origin xyz=".1 0 -.2"/><inertia ixx=".02" iyy=".03" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = (
        f'<robot name="r"><link name="base"/><link name="upper">{link}</link><link name="lower">{link}</link>'
        '<joint name="a" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>'
        '<joint name="b" type="prismatic"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -.4" rpy=".3 0 0"/>'
        '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="10" velocity="1"/></joint></robot>'
    )
    found = agreement(_model(tmp_path, text, "r.urdf"), "spook")

    assert found.resolved and found.apart < 0.1 * ALIKE


def test_damping_springs_and_servos_are_mujocos_as_the_step_falls(tmp_path: Path) -> None:
    """Plain steps against plain steps: what is between both halves with the step."""
    text = _arm(
        '<joint name="swing" axis="0 1 0" damping=".8" stiffness="5" armature=".1"/>',
        '<joint name="elbow" axis="1 0 0" damping=".3"/>',
        '<actuator><position joint="swing" kp="30" kv="2" gear="1.3"/><velocity joint="elbow" kv=".5"/><motor joint="elbow" gear="2"/></actuator>',
    )  # fmt: skip
    model = _model(tmp_path, text, drive=Drive(kind="sinusoid", amplitude=0.7, frequency=0.8))

    coarse, fine = (_both(model, 1.0, step)[2] for step in (2e-3, 1e-3))

    assert fine < 2e-3
    assert fine < 0.65 * coarse


def test_friction_limits_and_bounded_motors_hold_as_in_mujoco(tmp_path: Path) -> None:
    text = _arm(
        '<joint name="swing" axis="0 1 0" frictionloss="20"/>',
        '<joint name="elbow" axis="1 0 0" damping="1" range="-30 10" limited="true"/>',
        '<actuator><motor joint="elbow" gear="5" ctrlrange="-1 1" forcerange="-.8 .8" forcelimited="true" ctrllimited="true"/></actuator>',
    )  # fmt: skip
    model = _model(tmp_path, text, drive=Drive(kind="table", rows=((0.0, 4.0),)))
    ours, _, apart = _both(model, 2.0)

    assert apart < 5e-3  # MuJoCo's friction creeps and its limits yield
    assert abs(float(ours["violation"][-1])) < 1e-4


def test_servos_of_bounded_force_give_way_as_in_mujoco(tmp_path: Path) -> None:
    """Bounds that act for most of the way; what is between both halves with the step, and bounds are what makes the way."""
    text = _arm(
        '<joint name="swing" axis="0 1 0" damping=".2" armature=".1"/>',
        '<joint name="elbow" axis="1 0 0" damping=".05"/>',
        '<actuator><position joint="swing" kp="60" kv="3" forcerange="-1.5 1.5"/>'
        '<velocity joint="elbow" kv="2" forcerange="-.3 .3" gear="1.5"/></actuator>',
    )
    model = _model(tmp_path, text, drive=Drive(kind="table", rows=((0.0, 0.8, 2.0), (0.5, -0.8, -2.0))))
    free = _model(tmp_path, text.replace("-1.5 1.5", "-99 99"), "free.xml", drive=model.drive)

    (_, theirs, coarse), (_, _, fine) = (_both(model, 1.0, step) for step in (2e-3, 1e-3))
    unbounded = _both(free, 1.0, 2e-3)[1]

    assert fine < 2e-3
    assert fine < 0.65 * coarse
    assert np.abs(theirs["position"] - unbounded["position"]).max() > 0.05


def test_a_gear_and_a_weld_hold(tmp_path: Path) -> None:
    gear = '<equality><joint joint1="elbow" joint2="swing" polycoef="0 -2 0 0 0" solref=".004 1"/></equality>'
    _, _, geared = _both(_model(tmp_path, _arm(HINGE, '<joint name="elbow" axis="1 0 0"/>', gear)), 0.5)
    weld = '<equality><weld body1="arm" body2="tip" solref=".004 1"/></equality>'
    _, _, welded = _both(_model(tmp_path, _arm(HINGE, '<joint axis="1 0 0"/>', weld)), 0.5)

    assert geared < 2e-3
    assert welded < 2e-3


RESTS = """<mujoco><worldbody><geom type="plane" size="2 2 1" friction="1"/>
<body name="box" pos="0 0 .13"><freejoint/><geom type="box" size=".1 .1 .1" friction="1"/>
<geom type="box" size=".02 .02 .02" pos="0 0 .12" friction=".3"/></body>
<body name="ball" pos=".5 0 .1"><freejoint/><geom size=".1" contype="{bits}"/></body></worldbody>
<keyframe><key name="high" qpos="0 0 1 1 0 0 0 .5 0 1 1 0 0 0"/></keyframe></mujoco>"""


def test_what_rests_rests_where_it_should_and_carries_its_weight(tmp_path: Path) -> None:
    model = _model(tmp_path, RESTS.format(bits=1))
    found = find("spook").simulate(ModelRun(model=model, until_settled=True), time_step=0.002, duration=2.0)

    assert found["settled"] < 1.0
    assert [found.final_state[name][2] for name in ("box", "ball")] == pytest.approx([0.1, 0.1], abs=1e-4)
    assert float(found["load"]) == pytest.approx(1.0, abs=1e-3)
    assert float(found["overlap"]) < 1e-4


def test_bits_exclusions_and_keyframes_are_the_files(tmp_path: Path) -> None:
    text = RESTS.format(bits=2).replace(
        "<keyframe>", '<contact><exclude body1="box" body2="world"/></contact><keyframe>'
    )
    text = text.replace('contype="2"', 'contype="2" conaffinity="4"')
    model = _model(tmp_path, text, keyframe="high")
    asked = ModelRun(model=model, samples=(0.0, 0.8))
    found = find("spook").simulate(asked, time_step=0.002, duration=0.8)

    assert found["position"][0][:, 2] == pytest.approx([1.0, 1.0])
    assert found["position"][1][:, 2] == pytest.approx(
        1.0 - 0.5 * 9.81 * 0.8**2, abs=0.01
    )  # both fall through


def test_every_shape_lies_on_the_floor(tmp_path: Path) -> None:
    shapes = {
        "sphere": ('type="sphere" size=".1"', 0.1),
        "capsule": ('type="capsule" size=".1 .2" euler="90 0 0"', 0.1),
        "cylinder": ('type="cylinder" size=".2 .05"', 0.05),
        "box": ('type="box" size=".1 .2 .05"', 0.05),
        "mesh": ('type="mesh" mesh="brick"', 0.1),
        "ellipsoid": ('type="ellipsoid" size=".2 .2 .1"', 0.1),
    }
    bodies = "".join(
        f'<body name="{name}" pos="{place} 0 {height + 0.01}"><freejoint/><geom {geom}/></body>'
        for place, (name, (geom, height)) in enumerate(shapes.items())
    )
    corners = " ".join(f"{x} {y} {z}" for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.1, 0.1))
    text = (
        f'<mujoco><asset><mesh name="brick" vertex="{corners}"/></asset><worldbody><geom type="plane" size="9 9 1"/>'
        f"{bodies}</worldbody></mujoco>"
    )
    model = _model(tmp_path, text)
    found = find("spook").simulate(ModelRun(model=model, samples=(1.0,)), time_step=0.002, duration=1.0)

    heights = dict(zip((one.label for one in model.watched), found["position"][-1][:, 2], strict=True))
    for name, (_, height) in shapes.items():
        loss = 0.08 * height if name == "ellipsoid" else 1e-3  # a hull of 64 corners lies inside it
        assert heights[name] == pytest.approx(height, abs=loss), name


def test_a_ball_settles_in_the_valley_of_a_height_field(tmp_path: Path) -> None:
    rows = " ".join(f"{abs(x) / 4:.3f}" for _ in range(5) for x in range(-4, 5))  # a valley along y at x = 0
    text = (
        f'<mujoco><asset><hfield name="v" nrow="5" ncol="9" size="2 1 1 .1" elevation="{rows}"/></asset><worldbody>'
        '<geom type="hfield" hfield="v"/><body name="ball" pos=".3 .2 .6"><freejoint/><geom size=".1"/></body>'
        "</worldbody></mujoco>"
    )
    model = _model(tmp_path, text)
    end = find("spook").simulate(ModelRun(model=model, samples=(8.0,)), time_step=0.004, duration=8.0)
    x, y, z = end["position"][-1][0]

    assert (y, z) == pytest.approx((0.2, 0.1 * 5**0.25 / 5**0.25 * (1.25**0.5)), abs=0.03)
    assert abs(x) < 0.2


ELBOW = '<joint name="elbow" axis="1 0 0"/>'
WAVES = Drive(kind="sinusoid", amplitude=0.7, frequency=0.8)
SUM = '<tendon><fixed name="t" {}><joint joint="swing" coef="1"/><joint joint="elbow" coef="-.5"/></fixed></tendon>'
STRING = '<tendon><spatial range="0 .87" limited="true" solreflimit=".004 1"><site site="s"/><site site="o"/></spatial></tendon>'
FIN = '<body pos=".1 .2 0" euler="20 30 0"><geom type="ellipsoid" size=".1 .05 .02" mass=".4"/></body>'
PULLS = {  # what pulls, and what there is in its place to see that it does
    "a tendon's spring": (_arm(HINGE, ELBOW, SUM.format('stiffness="8" damping=".4" springlength=".3"')), 'stiffness="8" damping=".4"', ""),
    "a tendon's armature": (_arm(HINGE, ELBOW, SUM.format('armature=".2"')), 'armature=".2"', ""),
    "a tendon's friction": (_arm(HINGE, ELBOW, SUM.format('frictionloss="2" solreffriction=".004 1"')), 'frictionloss="2"', ""),
    "a tendon's limit": (_arm(HINGE, ELBOW, SUM.format('range="-.3 .1" limited="true" solreflimit=".004 1"')), '"true"', '"false"'),
    "a tendon's tie": (_arm(HINGE, ELBOW, SUM.format("") + '<equality><tendon active="true" tendon1="t" solref=".004 1"/></equality>'), '"true"', '"false"'),
    "a string": (_arm(HINGE, f'{ELBOW}<site name="s"/>', STRING).replace("<worldbody>", '<worldbody><site name="o" pos=".5 0 1.3"/>'), '"true"', '"false"'),
    "a servo of two joints": (_arm(HINGE, ELBOW, SUM.format("") + '<actuator><position tendon="t" kp="20" kv="1" gear="1.5"/></actuator>'), 'kp="20"', 'kp=".1"'),
    "the same of bounded force": (_arm(HINGE, ELBOW, SUM.format("") + '<actuator><position tendon="t" kp="60" kv="1" forcerange="-.5 .5"/></actuator>'), '"-.5 .5"', '"-9 9"'),
    "controls that are filtered": (_arm(HINGE, ELBOW, '<actuator><general joint="swing" dyntype="filter" dynprm=".1" gainprm="3"/><general joint="elbow" dyntype="integrator" gainprm="1"/><position joint="swing" timeconst=".3" kp="20" kv="1"/></actuator>'), 'gainprm="3"', 'gainprm="2"'),
    "a medium": (_arm(HINGE, ELBOW + FIN).replace("<option", '<option density="900" viscosity=".3" wind=".3 .2 0"'), 'density="900" viscosity=".3"', ""),
    "lift against gravity": (_arm(HINGE, ELBOW).replace('name="tip"', 'name="tip" gravcomp=".6"'), 'gravcomp=".6"', ""),
}  # fmt: skip


@pytest.mark.parametrize("what", PULLS)
def test_what_pulls_pulls_as_in_mujoco(what: str, tmp_path: Path) -> None:
    """A second with a push at the start: where it ends is due to the part, to a hundredth and to MuJoCo's softness."""
    text, part, instead = PULLS[what]
    text = text.replace("</mujoco>", '<keyframe><key qvel="2 -3"/></keyframe></mujoco>')
    drive = WAVES if "actuator" in text else Drive()
    model = _model(tmp_path, text, drive=drive, keyframe="0")
    other = _model(tmp_path, text.replace(part, instead), "other.xml", drive=drive, keyframe="0")

    _, theirs, apart = _both(model, 1.0, 5e-4)
    _, without, _ = _both(other, 1.0, 5e-4)

    assert apart < 0.01 * np.abs(theirs["position"] - without["position"]).max()


LACKING = (
    "a ball joint with springs, damping, limits or actuators (joint 'j' in line 2)",
    "a ball joint with armature or friction (joint 'j' in line 2)",
    "a tendon whose spring has play (tendon 't' in line 5)",
    "a tendon through space with damping (tendon 'w' in line 6)",
    "a tie of a tendon along one joint (equality 'e' in line 7)",
    "an actuator with activation dynamics that are not linear (actuator 't' in line 9)",
    "a medium that acts by the shape of geoms (fluidshape) (geom 'g' in line 2)",
    "gravity compensation that is not the same in all that is welded together (body 'b' in line 2)",
)


def test_what_it_lacks_is_named_with_its_line_and_all_of_it_at_once(tmp_path: Path) -> None:
    text = """<mujoco><option density="1.2"/><worldbody><site name="o"/>
<body name="b" gravcomp="1"><joint name="j" type="ball" damping="1" armature="1"/><geom name="g" size=".1" fluidshape="ellipsoid"/><site name="s" pos="1 0 0"/><body><geom size=".1"/></body>
<body pos="0 0 -1"><joint name="swing" axis="0 1 0"/><geom size=".1"/></body></body></worldbody>
<tendon>
<fixed name="t" stiffness="3" springlength=".1 .2"><joint joint="swing" coef="1"/></fixed>
<spatial name="w" damping="1"><site site="o"/><site site="s"/></spatial></tendon>
<equality><tendon name="e" tendon1="t"/></equality>
<actuator>
<muscle name="t" joint="swing" lengthrange="0 1"/></actuator></mujoco>"""
    model = _model(tmp_path, text)

    with pytest.raises(NotSupported) as refused:
        find("spook").simulate(ModelRun(model=model), time_step=0.002, duration=0.1)

    for said in LACKING:
        assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_it_lacks_is_found_in_included_files_and_by_its_body_where_it_has_no_name(
    tmp_path: Path,
) -> None:
    (tmp_path / "peg.xml").write_text(
        """<mujoco><worldbody>
<body name="peg"><joint type="free" damping="1"/><geom size=".1"/></body></worldbody></mujoco>"""
    )
    model = _model(tmp_path, '<mujoco><include file="peg.xml"/></mujoco>')

    with pytest.raises(NotSupported, match=r"friction \(joint of body 'peg' in line 2 of peg.xml\)"):
        find("spook").simulate(ModelRun(model=model), time_step=0.002, duration=0.1)


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ('<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>', "r.urdf, in line 3: .*'b'"),
        ('<collision><geometry><mesh filename="hand.dae"/></geometry></collision>', "r.urdf, in line 3: .*hand.dae.*convert it"),
    ],
)  # fmt: skip
def test_what_mujocos_parser_refuses_is_named_with_its_line(link: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "hand.dae").write_text("<COLLADA/>")
    text = f"""<robot name="r"><link name="a"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
<link name="b">{link}</link></robot>"""

    for engine in ("spook", "mujoco"):
        with pytest.raises(NotSupported, match=said):
            find(engine).simulate(
                ModelRun(model=_model(tmp_path, text, "r.urdf")), time_step=0.002, duration=0.1
            )


FLOOR = """<mujoco><option>{option}</option><default>{default}</default><worldbody>
<geom name="floor" type="plane" size="2 2 .1" {floor}/>
<body name="b" pos="0 0 .2"><joint name="root" type="free"/><geom name="box" type="box" size=".1 .1 .1"/>
<body pos=".3 0 0"><joint name="h" {joint}/><geom size=".05"/></body></body></worldbody>
<contact>{pair}</contact><actuator>{actuator}</actuator></mujoco>"""


@pytest.mark.parametrize(
    ("part", "text", "said"),
    [
        ("default", '<joint damping="1"/>', r"a free joint with springs, damping or friction \(joint 'root' in line 3\)"),
        ("default", '<joint armature="1"/>', r"a free joint with armature \(joint 'root' in line 3\)"),
        ("pair", '<pair name="p" geom1="floor" geom2="box" friction=".1 .2 .1 .1 .1"/>', r"differs with the direction \(pair 'p' in line 5\)"),
        ("pair", '<pair geom1="floor" geom2="box" friction="1 1 1 .1 .2"/>', r"differs with the direction \(pair 'floor and box'\)"),
        ("option", '<flag override="enable"/>', "for all contacts"),
        ("floor", 'surfacevel="1 0 0"', r"a surface that moves along itself \(geom 'floor' in line 2\)"),
        ("floor", 'adhesion="1"', r"a surface that clings \(geom 'floor' in line 2\)"),
        ("joint", 'stiffness="1" springyield="1"', r"springs or damping that are not linear \(joint 'h' in line 4\)"),
        ("actuator", '<motor name="a" joint="h" delay=".01" nsample="10"/>', r"an actuator with a delay \(actuator 'a' in line 5\)"),
    ],
)  # fmt: skip
def test_what_would_move_a_model_is_never_passed_over(
    part: str, text: str, said: str, tmp_path: Path
) -> None:
    parts = dict.fromkeys(("option", "default", "floor", "joint", "pair", "actuator"), "")
    model = _model(tmp_path, FLOOR.format(**parts | {part: text}))
    try:
        mujoco.MjModel.from_xml_path(model.path)
    except ValueError as older:
        assert "unrecognized attribute" in str(older)
        pytest.skip("this release of MuJoCo does not have it")

    with pytest.raises(NotSupported, match=said):
        find("spook").simulate(ModelRun(model=model), time_step=0.002, duration=0.1)


RUBBING = {
    "the larger": ("", "", "", 0.2),
    "the condim that says more": ('condim="1"', "", "", 0.2),
    "neither's": ('condim="1"', 'condim="1"', "", 0.0),
    "of higher priority": ('priority="1"', "", "", 0.1),
    "of higher priority, with its condim": ("", 'condim="1" priority="2"', "", 0.0),
    "of a pair that says nothing: one": ("", "", '<pair geom1="floor" geom2="box"/>', 1.0),
    "of their pair": ("", "", '<pair geom1="floor" geom2="box" friction=".15 .15 0 0 0"/>', 0.15),
    "of their pair, whatever their bits": (
        'contype="0"',
        'contype="0"',
        '<pair geom1="box" geom2="floor" condim="1"/>',
        0.0,
    ),
}


@pytest.mark.parametrize("of", RUBBING)
def test_two_surfaces_rub_as_mujoco_has_it(of: str, tmp_path: Path) -> None:
    """A box slides a second on a floor that is tilted: ½ (3 − 9.81 µ) m, of 0.1 and 0.2 the µ that MuJoCo takes."""
    floor, box, pair, friction = RUBBING[of]
    text = (
        '<mujoco><option gravity="3 0 -9.81"/><worldbody>'
        f'<geom name="floor" type="plane" size="9 9 .1" friction=".1" {floor}/>'
        '<body name="b" pos="0 0 .1"><freejoint/>'
        f'<geom name="box" type="box" size=".2 .2 .1" friction=".2" {box}/></body></worldbody><contact>{pair}</contact></mujoco>'
    )
    ours, theirs, apart = _both(_model(tmp_path, text), 1.0)

    assert ours["position"][-1, 0, 0] == pytest.approx(0.5 * max(0.0, 3.0 - 9.81 * friction), abs=2e-3)
    assert apart < 0.01  # their contacts are soft
    assert theirs.completed


def test_a_tie_that_is_open_at_the_start_is_refused(tmp_path: Path) -> None:
    tie = '<equality><connect name="far" body1="tip" anchor="0 0 0" solref=".01 1"/></equality>'
    text = _arm(HINGE, '<joint axis="1 0 0"/>', tie)
    bent = text.replace("</mujoco>", '<keyframe><key qpos="1 0"/></keyframe></mujoco>')

    with pytest.raises(NotSupported, match=r"a tie that starts .* apart .*\(equality 'far' in line 1\)"):
        find("spook").simulate(
            ModelRun(model=_model(tmp_path, bent, keyframe="0")), time_step=0.002, duration=0.1
        )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco><worldbody><body>", "is no XML"),
        (_arm(HINGE, "").replace("<geom", '<geom mesh="none" type="mesh"/><geom'), "mesh"),
        ('<!DOCTYPE x [<!ENTITY a "aaaa">]><mujoco/>', "declares XML entities"),
        (_arm(HINGE, "").replace("<worldbody>", '<asset><mesh file="../../out.stl"/></asset><worldbody>'), "outside"),
        (_arm(HINGE, "").replace("<worldbody>", '<asset><mesh file="none.stl"/></asset><worldbody>'), "no file"),
        ("<mujoco><!--" + "x" * 20_000_000 + "--><worldbody/></mujoco>", "20 MB"),
    ],
)  # fmt: skip
def test_a_bad_file_is_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(EngineError, match=said) as refused:
        find("spook").simulate(ModelRun(model=_model(tmp_path, text)), time_step=0.002, duration=0.1)

    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("engine", ["spook", "mujoco"])
def test_pushes_from_a_seed_are_part_of_a_model(engine: str, tmp_path: Path) -> None:
    """In every step up to a hundredth of the size a second: many steps later it is elsewhere, by the seed alone."""
    still = _model(tmp_path, RESTS.format(bits=1), keyframe="high")

    def end(**pushed: float) -> list[float]:
        asked = ModelRun(model=replace(still, **pushed), samples=(0.4,))  # type: ignore[arg-type]
        found = find(engine).simulate(asked, time_step=0.002, duration=0.4)["position"][-1]
        return list(found[:, :2].ravel())

    assert end() == [0.0, 0.0, 0.5, 0.0]
    assert end(push=0.01, seed=1) == end(push=0.01, seed=1) != end(push=0.01, seed=2)
    aside = np.subtract(
        end(push=0.01, seed=1), end()
    )  # random walks of speed, of 200 steps of .0058 sizes a second
    assert 2e-3 < np.abs(aside).max() < 0.1


def test_the_same_bits_come_twice_and_from_another_process(tmp_path: Path) -> None:
    model = _model(tmp_path, RESTS.format(bits=1))
    hashes = {
        find("spook")
        .simulate(ModelRun(model=model, elsewhere=where), time_step=0.002, duration=0.5)
        .state_hash
        for where in (False, False, True)
    }

    assert len(hashes) == 1


@pytest.mark.parametrize(("solref", "law"), [(".004 .15", 0.6502), ("-10000 -30", 0.6502), (".004 1", 0.0)])
@pytest.mark.parametrize("priority", [1, 0])
def test_a_ball_whose_softness_counts_rebounds_as_it_does_in_mujoco(
    tmp_path: Path, solref: str, law: float, priority: int
) -> None:
    """By exp(-2 tan f (pi/2 - f)), sin f = .15, of a fall from .8 m; where both softnesses count, ours says none."""
    text = f"""<mujoco><worldbody><geom type="plane" size="1 1 1"/><body name="ball" pos="0 0 .9"><freejoint/>
<geom size=".1" solref="{solref}" solimp=".9999 .9999 .001" priority="{priority}"/></body></worldbody></mujoco>"""
    top = np.sqrt(1.6 / 9.81) * (1.0 + law)  # s
    asked = ModelRun(model=_model(tmp_path, text), samples=(top,))
    run = find("spook").simulate(asked, time_step=0.001, duration=top)

    assert run["position"][0, 0, 2] - 0.1 == pytest.approx(0.8 * (law * priority) ** 2, abs=0.005)
