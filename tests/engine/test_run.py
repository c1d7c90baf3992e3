"""A simulation one can hold: in pieces the same bits, back and on again the same bits, and set from outside."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Ball,
    Box,
    ContactForce,
    Distance,
    EngineError,
    Final,
    Hinge,
    JointCoordinate,
    JointSpring,
    Load,
    MethodError,
    Motor,
    Particle,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    SceneError,
    SimulationFailed,
    Sphere,
    Table,
    Trace,
    Velocity,
    compile,
    explain,
    simulate,
    start,
)
from tests.engine.test_bits import rng, tumble
from tests.scenes import particle as particle_scenes
from tests.scenes import rigid as rigid_scenes


def test_a_run_goes_on_from_a_final_state() -> None:
    scene = rigid_scenes.tree(rng())
    whole = simulate(scene, time_step=0.01, steps=80)
    half = simulate(scene, time_step=0.01, steps=40)
    with start(scene, time_step=0.01, state=half.final_state) as run:
        for name, state in half.final_state.items():
            np.testing.assert_allclose(run.state[name], state, rtol=0.0, atol=1e-12)
        run.step(40)

        for name, state in whole.final_state.items():
            np.testing.assert_allclose(run.state[name], state, rtol=0.0, atol=1e-9)


def slider(**changes: Any) -> Scene:
    block = RigidBody(name="block", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    rail = Prismatic(name="rail", between=(WORLD, "block"), axis=(1.0, 0.0, 0.0), **changes)
    push = Load(name="push", body="block")
    return Scene(bodies=(block,), constraints=(rail,), forces=(push,))


def test_a_controller_sees_its_load_in_the_next_step() -> None:
    # x'' = u/m with u = −k x − d x', each step by hand: v₊ = v + h u/m, x₊ = x + h v₊.
    h, mass, x, v = 0.01, 2.0, 0.0, 0.0
    with start(slider(), time_step=h, observe={"x": JointCoordinate("rail")}) as run:
        for _ in range(200):
            force = -30.0 * (x - 1.0) - 8.0 * v
            run.set_load("push", force=(force, 0.0, 0.0))
            run.step()
            v += h * force / mass
            x += h * v

            assert float(run["x"]) == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize("kind", [Particle, RigidBody])
def test_a_load_of_zero_in_the_scene_can_be_set(kind: type) -> None:
    extra = {} if kind is Particle else {"inertia": (1.0, 1.0, 1.0)}
    body = kind(name="body", mass=4.0, position=(0.0, 0.0, 0.0), **extra)
    scene = Scene(bodies=(body,), forces=(Load(name="push", body="body"),))
    with start(scene, time_step=0.5) as run:
        run.step(2)
        run.set_load("push", force=(8.0, 0.0, 0.0))
        run.step(2)

        assert run.state["body"][7] == 2.0  # m/s: 8 N over 1 s on 4 kg
    assert "apply_loads" not in {c.stage for c in explain(scene, time_step=0.5) if c.kept}


def test_several_loads_are_set_as_each_by_itself() -> None:
    bodies = tuple(
        RigidBody(name=name, mass=4.0, inertia=(1.0, 1.0, 1.0), position=(x, 0.0, 0.0)) for name, x in (("a", 0.0), ("b", 3.0))
    )  # fmt: skip
    loads = tuple(Load(name=name, body=body) for name, body in (("push", "a"), ("pull", "a"), ("lift", "b")))
    forces = {"push": (8.0, 0.0, 0.0), "pull": (-2.0, 4.0, 0.0), "lift": (0.0, 0.0, 2.0)}
    ends = []
    for together in (False, True):
        with start(Scene(bodies=bodies, forces=loads), time_step=0.5) as run:
            run.set_load("pull", torque=(0.0, 0.0, 1.0))
            before = run.save()
            if together:
                run.set_loads(forces)
            else:
                for name, force in forces.items():
                    run.set_load(name, force=force)
            run.step(2)
            ends.append(run.result().state_hash)

            assert run.state["a"][7:].tolist() == [1.5, 1.0, 0.0, 0.0, 0.0, 1.0]
            run.restore(before)
            run.step()
            assert run.state["a"][7:10].tolist() == [0.0, 0.0, 0.0]
    assert ends[0] == ends[1]


def test_targets_of_drives_follow_what_is_set_and_go_back_with_a_snapshot() -> None:
    with start(slider(motor=Motor(speed=0.0)), time_step=0.1) as run:
        saved = run.save()
        run.set_motor("rail", speed=3.0)
        run.step()
        assert run.state["block"][7] == pytest.approx(3.0, abs=1e-12)
        run.restore(saved)
        run.step()
        assert run.state["block"][7] == 0.0
    sprung = slider(spring=JointSpring(stiffness=50.0, damping=0.2))
    with start(sprung, time_step=0.01, observe={"x": JointCoordinate("rail")}) as run:
        run.set_rest("rail", 0.25)
        run.step(3000)
        assert float(run["x"]) == pytest.approx(0.25, abs=1e-9)


def test_a_kinematic_body_moves_as_it_is_told() -> None:
    table = RigidBody(name="table", motion="kinematic", shape=Box((1.0, 1.0, 0.1)), position=(0.0, 0.0, 0.0))
    ball = RigidBody(name="ball", mass=1.0, shape=Sphere(0.1), position=(0.0, 0.0, 3.0))
    with start(Scene(bodies=(table, ball)), time_step=0.1) as run:
        run.set_velocity("table", velocity=(0.0, 0.0, 2.0))
        run.step(10)
        run.set_velocity("table", velocity=(0.0, 0.0, -1.0))
        run.step(10)

        assert run.state["table"][2] == pytest.approx(1.0, abs=1e-12)


def test_forces_read_now_are_those_of_the_step_that_ended() -> None:
    with start(tumble(), time_step=1 / 60, observe={"floor": ContactForce("floor")}) as run:
        assert not np.any(run["floor"])
        run.step(600)
        weight = 9.81 * 15.0

        assert run["floor"][2] == pytest.approx(-weight, rel=1e-3)


def test_a_run_that_fails_says_so_and_can_go_back() -> None:
    weight = Particle(name="weight", mass=1.0, position=(1.0, 0.0, 0.0))
    scene = Scene(bodies=(weight,), forces=(Load(name="push", body="weight"),))
    with start(scene, time_step=0.01) as run:
        run.step(10)
        saved = run.save()
        run.set_load("push", force=(1e300, 0.0, 0.0))
        with pytest.raises(SimulationFailed, match="'weight' ran away"):
            run.step(100)
        with pytest.raises(SimulationFailed):
            run.step()
        assert "failed" in repr(run)
        run.restore(saved)
        run.step()

        assert run.result().completed
        assert run.steps == 11


def test_what_a_failed_run_counts_is_the_work_of_its_steps_however_long_its_blocks_were() -> None:
    """A block that ends unfit is taken back and taken step by step; how long it is follows the clock."""
    ends = [
        RigidBody(name=name, mass=1.0, position=(x, 0.0, 0.0), inertia=(1.0, 2.0, 3.0))
        for name, x in (("a", 0.1), ("b", 1.0))
    ]
    jump = Table((0.0, 0.49, 0.5, 9.0), (0.0, 0.0, 1.0, 1.0))
    scene = Scene(
        bodies=tuple(ends),
        constraints=(Ball(name="joint", between=("a", "b"), at=(0.5, 0.3, 0.1)),),
        forces=(Load(name="blast", body="a", force=(1e300, 0.0, 0.0), factor=jump),),
    )
    whole = simulate(scene, time_step=0.01, steps=400)
    with start(scene, time_step=0.01) as run, pytest.raises(SimulationFailed) as failed:
        for _ in range(400):
            run.step()
    stepwise = failed.value.result

    assert whole.status == stepwise.status == "not_finite"
    assert whole.steps == stepwise.steps == 50
    for work in ("factorisations", "block_operations", "back_substitutions"):
        assert whole.counters[work] == stepwise.counters[work] > 0, work


def test_a_time_limit_takes_the_unfinished_block_back() -> None:
    scene = tumble()
    whole = simulate(scene, time_step=0.01, steps=64)
    with start(scene, time_step=0.01) as run:
        with pytest.raises(SimulationFailed, match="time limit"):
            run.step(10**9, time_limit=0.05)
        done = run.steps
        assert run.result().steps == done
        if done <= 64:
            run.step(64 - done)
            assert run.result().state_hash == whole.state_hash


def hostile() -> dict[str, tuple[Any, type, str]]:
    driven = slider(motor=Motor(speed=1.0))

    def on(scene: Scene, act: Any) -> Any:
        def do() -> None:
            with start(scene, time_step=0.1) as run:
                act(run)

        return do

    def closed() -> None:
        with start(driven, time_step=0.1) as run:
            pass
        run.step()

    def foreign() -> None:
        with start(driven, time_step=0.1) as one, start(driven, time_step=0.2) as other:
            other.restore(one.save())

    rail = {"x": Final(quantity=JointCoordinate("rail"))}
    return {
        "steps": (on(driven, lambda run: run.step(1.5)), MethodError, "steps"),
        "negative steps": (on(driven, lambda run: run.step(-1)), MethodError, "steps"),
        "wordy limit": (on(driven, lambda run: run.step(time_limit="1")), MethodError, "time_limit must be"),
        "a program's limit": (
            lambda: compile(driven, time_step=0.1).run(1, time_limit=math.nan),
            MethodError,
            "time_limit must be",
        ),
        "a program's steps": (lambda: compile(driven, time_step=0.1).run(2.0), MethodError, "steps must be"),  # type: ignore[arg-type]
        "a scalar state": (
            lambda: start(driven, time_step=0.1, state={"block": 3.0}),  # type: ignore[dict-item]
            MethodError,
            "13 numbers",
        ),
        "no such load": (on(driven, lambda run: run.set_load("pull")), SceneError, "'pull'"),
        "no such load among several": (
            on(driven, lambda run: run.set_loads({"pull": (0.0, 0.0, 0.0)})),
            SceneError,
            "'pull'",
        ),
        "load of NaN": (
            on(driven, lambda run: run.set_load("push", force=(math.nan, 0, 0))),
            SceneError,
            "finite",
        ),
        "no motor": (on(slider(), lambda run: run.set_motor("rail", speed=1.0)), SceneError, "no motor"),
        "bound of a boundless motor": (
            on(driven, lambda run: run.set_motor("rail", max_force=1.0)),
            SceneError,
            "unbounded",
        ),
        "no spring": (on(driven, lambda run: run.set_rest("rail", 1.0)), SceneError, "no spring"),
        "a dynamic body told": (
            on(driven, lambda run: run.set_velocity("block")),
            SceneError,
            "not kinematic",
        ),
        "reduction": (
            lambda: start(driven, time_step=0.1, observe=rail),  # type: ignore[arg-type]
            MethodError,
            "quantity itself",
        ),
        "closed": (closed, MethodError, "closed"),
        "foreign snapshot": (foreign, MethodError, "another scene"),
        "state of strangers": (
            lambda: start(driven, time_step=0.1, state={"ghost": np.zeros(13)}),
            SceneError,
            "'ghost'",
        ),
        "a state of no size": (
            lambda: start(driven, time_step=0.1, state={"block": np.array(3.0)}),
            MethodError,
            "13 numbers",
        ),
        "a name of numbers": (
            on(driven, lambda run: run.set_velocity(np.zeros(3))),  # type: ignore[arg-type]
            SceneError,
            "no body named",
        ),
        "half a state": (lambda: start(driven, time_step=0.1, state={}), MethodError, "'block' is missing"),
        "state of NaN": (
            lambda: start(driven, time_step=0.1, state={"block": np.full(13, np.nan)}),
            SceneError,
            "finite",
        ),
    }


@pytest.mark.parametrize("name", hostile())
def test_hostile_input_is_refused_with_one_sentence(name: str) -> None:
    act, kind, words = hostile()[name]
    with pytest.raises(kind, match=words) as caught:
        act()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("length", [2.0, 1.5, 0.1, 1e-3, 1e200, 1.0 + 1e-9])
def test_a_state_may_say_its_turn_at_any_length(length: float) -> None:
    """As the orientation of a body in a scene: scaled to a unit quaternion, and else to the bit as it is given."""
    free = RigidBody(name="it", mass=1.0, inertia=(1.0, 2.0, 2.5), position=(0.0, 0.0, 0.0))
    turn = np.array([0.8, 0.1, -0.5, 0.3])
    turn /= np.linalg.norm(turn)
    found = []
    for scale in (1.0, length):
        state = {"it": np.array([0.0, 0.0, 0.0, *(scale * turn), 0.0, 0.0, 0.0, 0.3, -1.0, 0.5])}
        with start(Scene(bodies=(free,)), time_step=0.01, state=state) as run:
            run.step(50)
            found.append(run.state["it"])

    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1e-14)
    assert np.linalg.norm(found[1][3:7]) == pytest.approx(1.0, abs=1e-15)


def test_traces_are_columns_of_a_dataframe() -> None:
    weight = Particle(name="weight", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "weight"))
    scene = Scene(bodies=(weight,), constraints=(rod,), gravity=(0.0, 0.0, -9.81))
    result = simulate(
        scene,
        time_step=0.01,
        steps=10,
        observe={
            "x": Trace(quantity=Position("weight")),
            "all": Trace(quantity=Velocity(), every=5),
            "end": Final(quantity=Position("weight")),
        },
    )
    frame = result.to_dataframe()

    assert list(frame.columns) == ["x.x", "x.y", "x.z", "all.0", "all.1", "all.2"]
    assert frame.index.name == "time" and len(frame) == 11
    np.testing.assert_array_equal(frame["x.z"], result["x"][:, 2])
    assert frame["all.0"].count() == 3
    assert repr(result).startswith("<Result: completed; 10 steps of 0.01 s; x (11, 3)")
    assert len(repr(result)) < 200
    hostile = simulate(scene, time_step=0.01, steps=1, observe={"<b>": Final(quantity=Position("weight"))})
    assert "<tr><th>&lt;b&gt;</th><td>array of shape (3,)</td></tr>" in hostile._repr_html_()
    with pytest.raises(EngineError, match="observe a Trace"):
        simulate(scene, time_step=0.01, steps=1).to_dataframe()


def test_a_hinge_that_is_held_counts_its_turns() -> None:
    wheel = RigidBody(name="wheel", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    axle = Hinge(name="axle", between=(WORLD, "wheel"), motor=Motor(speed=5.0))
    observe = {"angle": JointCoordinate("axle")}
    with start(Scene(bodies=(wheel,), constraints=(axle,)), time_step=0.01, observe=observe) as run:
        run.step(500)

        assert float(run["angle"]) == pytest.approx(25.0, abs=0.05)


def test_particles_on_rows_go_on_from_a_final_state_with_the_same_bits() -> None:
    scene = particle_scenes.chain(rng())
    whole = simulate(scene, time_step=0.01, steps=80)
    half = simulate(scene, time_step=0.01, steps=33)
    with start(scene, time_step=0.01, state=half.final_state) as run:
        run.step(47)

        assert run.result().state_hash == whole.state_hash
