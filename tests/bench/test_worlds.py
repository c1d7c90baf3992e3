"""Many worlds in one call: each of them is the one world, and what an engine has not is said in its row."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import bench.worlds as worlds
from spook_tracker.engine import Final, Position
from spook_tracker.engine.find import find


def test_ours_errs_as_its_step_has_it_and_processes_change_no_bit() -> None:
    """Symplectic steps: h v/2 behind where it slides; and the same bits one after another and side by side."""
    slid = worlds.batch("slope", "spook", None, 60, 3, 1)
    speed = float(np.linalg.norm(worlds.slope_grid.downhill(0.5, 0.0, 1.0)))
    assert slid.error == pytest.approx(0.5 * speed / 60.0 * np.cos(worlds.slope_grid.ASKEW), rel=1e-6)
    one, two = (worlds.ours("pendulum", 1 / 240, 5, processes)[0] for processes in (1, 2))
    assert one.shape == (5, 1, 3) and np.array_equal(one, two)


@pytest.mark.parametrize(
    ("engine", "package"),
    [("newton", "newton"), ("mujoco_warp", "mujoco_warp"), ("mjx", "mujoco.mjx"), ("motrixsim", "motrixsim")],
)
def test_every_world_of_a_batch_is_the_one_world(engine: str, package: str) -> None:
    pytest.importorskip(package, reason=f"the extra {engine} is not installed")
    adapter = find(engine).adapter
    asked = 0
    places = {name: place for name, place in worlds.PLACES.items() if engine != "mjx" or name == "pendulum"}
    for name, place in places.items():  # of contacts MuJoCo XLA compiles minutes
        for setting in adapter.configurations[:4:3]:
            task = worlds.task_of(place, 1 / 60, setting)
            alone = partial(find(engine).simulate, configuration=setting.name)
            try:
                found = adapter.worlds(task, 3).positions
            except worlds.NotSupported:
                continue
            end = alone(
                task.scene, time_step=1 / 60, steps=task.steps, observe={"x": Final(quantity=Position())}
            )["x"]
            np.testing.assert_allclose(found, np.tile(end, (3, 1, 1)), atol=2e-3, err_msg=name)
            asked += 1
    assert asked >= len(places) // 2 + 1


def test_a_batch_that_takes_too_long_is_left_out_and_the_device_is_said(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []

    def batch(name: str, engine: str, setting: object, per_second: int, count: int, processes: int) -> object:
        asked.append(count)
        return worlds.Row(name, engine, per_second, count, 1.0, 0.0, 0.1 * count)

    monkeypatch.setattr(worlds, "batch", batch)
    assert worlds.main(["--scene", "slope", "--steps", "60", "--limit", "2", "spook"]) == 0
    assert asked == [1, 16]
    assert worlds.ON_CPU in capsys.readouterr().out
    with pytest.raises(SystemExit):
        worlds.main(["jolt"])
    assert (
        "'jolt' has no worlds; there are spook, mjx, motrixsim, mujoco_warp, newton"
        in capsys.readouterr().err
    )
