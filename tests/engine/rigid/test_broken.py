"""Which joint broke, when, and under what: against the load that is known in advance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import ConstraintForce, Method, Position, Scene, Trace, Wire, simulate, start
from tests.scenes.coupling import H, hung, masses

FORCE, TORQUE = 105.05, 45.0


def test_a_joint_breaks_in_the_first_step_whose_load_exceeds_its_strength() -> None:
    """20 N of weight and 10 t N more, taken where each step begins: the load of step n is 20 + 10 (n − 1) h."""
    observe = {"x": Trace(quantity=Position("body")), "f": Trace(quantity=ConstraintForce("lock"))}
    result = simulate(hung(strength=FORCE), time_step=H, duration=8.7, observe=observe)
    (broke,) = result.broken
    step = 1 + int(np.ceil((FORCE - 20.0) / (10.0 * H)))
    assert (broke.joint, broke.step, broke.time) == ("lock", step, pytest.approx(step * H))
    assert broke.force == pytest.approx(20.0 + 10.0 * (step - 1) * H, rel=1e-9) and broke.force > FORCE
    np.testing.assert_allclose(np.linalg.norm(result["f"][step][:3]), broke.force, rtol=1e-12)
    assert np.all(result["f"][step + 1 :] == 0.0)
    assert f"'lock' broke in step {step} ({step * H:.4g} s) under {broke.force:.4g} N" in repr(result)
    assert "lock" in result._repr_html_()
    frame = result.to_dataframe()
    assert frame["lock broken"].sum() == len(frame) - step
    assert not frame["lock broken"].iloc[step - 1] and frame["lock broken"].iloc[step]


def test_a_torque_breaks_it_too_and_nothing_is_told_where_nothing_broke() -> None:
    (broke,) = simulate(hung(torque_strength=TORQUE), time_step=H, duration=12.0).broken
    assert broke.torque > TORQUE >= broke.torque - 10.0 * H * 1.0 - 1e-9
    whole = simulate(
        hung(strength=1e6), time_step=H, duration=1.0, observe={"x": Trace(quantity=Position("body"))}
    )
    assert whole.broken == () and "broke" not in repr(whole)
    assert [c for c in whole.to_dataframe().columns if "broken" in c] == []


@pytest.mark.parametrize("substeps", [1, 4])
def test_a_wire_breaks_in_its_first_step_under_its_tension(substeps: int) -> None:
    scene = masses()
    wire = scene.constraints[0]
    assert isinstance(wire, Wire)
    scene = Scene(bodies=scene.bodies, constraints=(replace(wire, strength=14.0),), gravity=scene.gravity)
    result = simulate(scene, time_step=H, steps=3, method=Method(substeps=substeps))
    (broke,) = result.broken
    assert (broke.joint, broke.step) == ("wire", 1)
    assert broke.time == pytest.approx(H / substeps)
    assert broke.force == pytest.approx(2.0 * 3.0 * 1.0 * 10.0 / 4.0)  # 2 m₁ m₂ g/(m₁ + m₂)


def test_a_held_run_goes_back_to_before_it_broke() -> None:
    observe: dict[str, Any] = {"x": Position("body")}
    with start(hung(strength=FORCE), time_step=H, observe=observe) as run:
        run.step(800)
        assert run.result().broken == ()
        before = run.save()
        run.step(60)
        (broke,) = run.result().broken
        run.restore(before)
        assert run.result().broken == ()
        run.step(60)
        assert run.result().broken == (broke,)
