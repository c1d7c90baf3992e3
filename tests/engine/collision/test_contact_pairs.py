"""Which bodies touch: collision is left out where nothing can touch, and pairs can be excepted."""

from __future__ import annotations

from spook_tracker.engine import Final, Lock, Position, Scene, explain, simulate
from tests.scenes.contact import DOWN, TIME_STEP, ball, ground


def test_collision_is_left_out_when_nothing_can_touch() -> None:
    falling = ball(height=5.0)
    scenes = {
        "alone": Scene(bodies=(falling,), gravity=DOWN),
        "contacts off": Scene(bodies=(ground(), falling), gravity=DOWN, contacts=False),
        "listed": Scene(bodies=(ground(), falling), gravity=DOWN, no_contact=(("ball", "ground"),)),
        "tied": Scene(
            bodies=(ground(), falling),
            gravity=DOWN,
            constraints=(Lock(name="lock", between=("ground", "ball")),),
        ),
    }
    for name, scene in scenes.items():
        kept = {choice.stage for choice in explain(scene, time_step=TIME_STEP, observe={}) if choice.kept}
        assert not kept & {"collision", "impact", "pivot", "friction", "tangents"}, name
    kept = {
        choice.stage
        for choice in explain(
            Scene(bodies=(ground(), falling), gravity=DOWN), time_step=TIME_STEP, observe={}
        )
        if choice.kept
    }
    assert {"collision", "impact", "pivot"} <= kept
    assert "friction" not in kept


def test_bodies_that_must_not_touch_pass_through_each_other() -> None:
    scene = Scene(bodies=(ground(), ball(height=0.6)), gravity=DOWN, no_contact=(("ground", "ball"),))
    result = simulate(
        scene, time_step=TIME_STEP, duration=1.0, observe={"z": Final(quantity=Position("ball"))}
    )

    assert result["z"][2] < -3.0


# Many -------------------------------------------------------------------------------------------------------
