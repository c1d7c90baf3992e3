"""Newton behind the protocol: six solvers against closed forms, to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import bench.engine_facts as engine_facts
from spook_tracker.engine import ContactForce, Final, Load, Position, Scene, SimulationFailed, Trace
from spook_tracker.engine.find import find
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.stacks import resting_grid
from tests.scenes import peer as peer_scenes

pytest.importorskip("newton", reason="the extra newton is not installed: pip install 'spook-tracker[newton]'")
pytest.importorskip("mujoco_warp", reason="the extra newton lacks mujoco-warp")
H = 1.0 / 60.0


def run(configuration: str) -> Any:
    return partial(find("newton").simulate, configuration=configuration)


def test_a_pendulum_keeps_its_length_and_its_energy_to_single_precision_by_runge_kutta_alone() -> None:
    found = {name: peer_scenes.swung(run(name), 1 / 240) for name in ("mujoco", "featherstone", "xpbd")}

    assert all(length < 2e-6 for length, _ in found.values())
    assert found["mujoco"][1] < 1e-5
    assert 1e-4 < found["featherstone"][1] < 1e-3
    assert found["xpbd"][1] > 0.05  # what its positions are corrected by is lost


def test_a_contact_shows_the_weight_it_carries_where_the_solver_shows_any() -> None:
    observe = {"f": Final(quantity=ContactForce("box", "ground"))}
    for name in ("mujoco", "xpbd", "kamino", "vbd"):
        found = run(name)(peer_scenes.box_on_ground(0.0), time_step=H, duration=1.0, observe=observe)
        assert found["f"] == pytest.approx([0.0, 0.0, 9.81], abs=0.02), name


def test_a_stack_of_ten_has_room_for_its_contacts() -> None:
    """By SolverMuJoCo's own guess half of them are left out, and the stack falls."""
    observe = {"way": Final(quantity=Position(), from_start=True)}
    found = run("mujoco")(resting_grid.stack(*(1.0,) * 10), time_step=H, steps=30, observe=observe)
    assert np.abs(found["way"]).max() < 5e-3


def test_a_load_as_large_as_the_weight_keeps_a_body_where_it_is() -> None:
    scene = replace(peer_scenes.nodding(), constraints=(), gravity=(0.0, 0.0, -9.81))
    still = tuple(replace(b, velocity=(0, 0, 0), angular_velocity=(0, 0, 0)) for b in scene.bodies)  # type: ignore[call-arg]
    loads = tuple(Load(name=f"up {b.name}", body=b.name, force=(0.0, 0.0, 9.81)) for b in still)
    observe = {"way": Trace(quantity=Position(), from_start=True)}
    found = run("featherstone")(
        Scene(bodies=still, forces=loads, gravity=scene.gravity), time_step=H, steps=60, observe=observe
    )
    assert np.abs(found["way"]).max() < 1e-5


def test_steps_replayed_as_a_graph_are_those_launched_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    from spook_tracker.engine.peers import newton

    def ends() -> list[str]:
        box = peer_scenes.box_on_ground(0.7)
        return [
            run(c.name)(box, time_step=H, steps=11, observe={}).state_hash
            for c in newton.ENGINE.configurations
        ]

    replayed = ends()
    monkeypatch.setattr(newton._World, "replay", lambda world: None)
    assert ends() == replayed


def test_a_solver_whose_package_is_missing_says_so_and_blames_no_model(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def without(*_: Any, **__: Any) -> None:
        raise ImportError("No module named 'mujoco_warp'")

    newton = pytest.importorskip("newton")
    monkeypatch.setattr(newton.solvers.SolverMuJoCo, "__init__", without)
    with pytest.raises(
        NotSupported, match=r"needs a package that is not installed: No module named 'mujoco_warp'"
    ):
        peer_scenes.fall_error(run("mujoco"), H)


def test_nothing_is_said_on_standard_output(capfd: pytest.CaptureFixture[str]) -> None:
    """Warp tells of its devices and of every kernel it compiles, MuJoCo of what is not finite."""
    peer_scenes.fall_error(run("mujoco"), H)
    with pytest.raises(SimulationFailed, match="not finite"):
        engine_facts.ARM["fact_arm"].measurements[0].measure(run("featherstone"))
    assert capfd.readouterr() == ("", "")


def test_featherstone_comes_apart_on_an_arm_with_stops_that_mujoco_holds() -> None:
    """newton-physics/newton#4269: its stops are springs whose frequency does not ask for a link's inertia."""
    for measurement in engine_facts.ARM["fact_arm"].measurements:
        with pytest.raises(SimulationFailed, match="not finite"):
            measurement.measure(run("featherstone"))
        assert measurement.measure(run("mujoco"))["energy_gain"] < 1e-4


def test_xpbd_is_of_order_one_and_carries_a_hundred_times_a_link_or_a_box() -> None:
    asked = {
        name: engine_facts.FACTS[f"fact_{name}"].measurements[0].measure
        for name in ("order", "hung", "stacked")
    }

    assert asked["order"](run("xpbd"))["order"] == pytest.approx(1.0, abs=0.05)
    assert asked["hung"](run("xpbd"))["hung"] == 100.0
    assert asked["stacked"](run("xpbd"))["stacked"] == 100.0
    assert asked["stacked"](run("mujoco"))["stacked"] >= 1e4
