"""DART behind the protocol gives what DART is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from spook_tracker.engine import Scene
from spook_tracker.engine.find import find
from spook_tracker.engine.protocol import NotSupported
from tests.scenes import peer as peer_scenes

pytest.importorskip("dartpy", reason="the extra dart is not installed: pip install 'spook-tracker[dart]'")
STEP = 1.0 / 60.0  # s


def run(configuration: str) -> Any:
    def simulate(scene: Scene, **options: Any) -> Any:
        return find("dart").simulate(scene, configuration=configuration, **options)

    return simulate


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
def test_semi_implicit_euler_blows_up_on_a_chain_and_says_so(time_step: float) -> None:
    """DART goes on with zeros in place of what is not finite; the run is ended before that."""
    found, _, _ = peer_scenes.stretched_and_gained(run("joints"), 26, time_step, 22.0)

    assert found.status == "diverged"
    assert "faster than 1e+50" in found.failure


def test_a_long_beam_holds_better_than_in_engines_of_impulses() -> None:
    """Half a second of thirty boxes: free fall is 1.2 m, a direct method leaves millimetres."""
    assert 1e-9 < peer_scenes.sag(run("constraints"), count=30) < 0.02


def test_more_contacts_than_it_takes_in_a_step_are_not_supported() -> None:
    ground, box = peer_scenes.box_on_ground(0.0).bodies
    boxes = tuple(
        replace(box, name=f"{k}", position=(2.0 * (k % 20), 2.0 * (k // 20), 0.5))  # type: ignore[arg-type]
        for k in range(260)
    )
    scene = Scene(bodies=(ground, *boxes), gravity=peer_scenes.GRAVITY)
    with pytest.raises(NotSupported, match="1000 contact points"):
        run("joints")(scene, time_step=STEP, steps=2)
    assert (
        run("joints")(replace(scene, bodies=scene.bodies[:200]), time_step=STEP, steps=2).status
        == "completed"
    )
