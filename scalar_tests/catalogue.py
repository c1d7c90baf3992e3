"""Every scalar test by topic and name: the table that `tracker run` goes through, whose order lists and pages keep.

A new test is a file and a line here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from importlib import import_module

from . import case

# topic: name of each of its tests, and the module of the topic's folder that holds it as TEST
TOPICS: dict[str, dict[str, str]] = {
    "thesis": {
        "beam": "beam.question",
        "door": "door.question",
        "falling_object": "falling_object",
        "friction": "inclined_plane.friction",
        "pendulum": "pendulum.question",
        "n_pendulum": "n_pendulum.question",
        "planetarium": "planetarium.question",
        "cantilever": "cantilever.question",
        "slip_angle": "inclined_plane.slip_angle",
        "force_ratio": "inclined_plane.force_ratio",
        "slope_grid": "inclined_plane.slope_grid",
    },
    "oscillators": {
        "oscillator_spring": "oscillator.spring",
        "oscillator_row": "oscillator.row",
        "oscillator_damped": "oscillator.damped",
        "oscillator_filter": "oscillator.filter",
        "double_pendulum": "double_pendulum",
        "bar_pendulum": "bar_pendulum",
        "seconds_pendulum": "seconds_pendulum",
    },
    "impacts": {
        "bouncing_ball": "bouncing_ball",
        "bounce_grid": "bounce_grid",
        "blow": "blow",
        "between_walls": "between_walls",
        "billiards": "billiards",
        "cradle": "cradle",
        "near_miss": "near_miss",
        "oblique_impact": "oblique_impact",
        "last_bounce": "last_bounce",
    },
    "stacks and piles": {
        "solver_options": "solver_options",
        "overhang": "overhang",
        "leaning_cards": "leaning_cards",
        "card_house": "card_house",
        "resting_box": "resting_box",
        "resting_ball": "resting_ball",
        "resting_stack": "resting_stack",
        "resting_grid": "resting_grid",
        "pile": "pile",
        "falling_pile": "falling_pile",
        "masonry_arch": "masonry_arch",
        "stone_bridge": "stone_bridge",
        "rocking_block": "rocking_block",
        "shaken_block": "shaken_block",
    },
    "friction": {
        "edge_roll": "edge_roll",
        "capstan": "capstan",
        "conveyor": "conveyor",
        "turntable": "turntable",
        "sorting": "sorting",
        "rolling_friction": "rolling_friction",
        "coin_field": "coin_field",
        "grain": "grain",
        "seams": "seams",
    },
    "rotation": {
        "rotating_box": "rotating_box",
        "thrown_die": "thrown_die",
        "steady_turns": "steady_turns",
        "flywheel": "flywheel",
        "rolling_sphere": "rolling_sphere",
        "spinning_top": "spinning_top",
        "rolling_coin": "rolling_coin",
        "bowl": "bowl",
        "rolling_beats": "rolling_beats",
    },
    "mechanisms": {
        "swinging_door": "swinging_door",
        "lock_ring": "lock_ring",
        "motor": "motor",
        "scissor_lift": "scissor_lift",
        "gears": "gears",
        "slider_crank": "slider_crank",
        "loose_bearing": "loose_bearing",
        "latch": "latch",
    },
    "ropes and wires": {
        "hanging_chain": "hanging_chain.question",
        "loaded_rods": "loaded_rods",
        "wires": "wires",
        "hanging_cable": "hanging_cable",
        "taut_rope": "taut_rope",
        "rope": "rope",
        "falling_chain": "falling_chain",
    },
    "fluids": {
        "floating_box": "floating_box",
        "rolling_log": "rolling_log",
        "sinking_sphere": "sinking_sphere",
    },
    "vehicles": {
        "vehicle": "vehicle",
        "climb": "climb",
        "suspension": "suspension",
        "cornering": "cornering",
        "rover": "rover",
    },
    "robots": {
        "robot_arm": "robot_arm",
        "arm_path": "arm_path",
        "grasp": "grasp",
        "box_push": "box_push",
        "quadruped": "quadruped",
        "humanoid": "humanoid",
    },
    "multibody library": {
        "simple_pendulum": "simple_pendulum",
        "four_bars": "four_bars",
        "squeezer": "squeezer",
        "bricard": "bricard",
        "governor": "governor",
    },
}
FOLDERS = {"stacks and piles": "stacks", "ropes and wires": "ropes", "multibody library": "multibody"}
QUESTIONS = {
    name: f"{FOLDERS.get(topic, topic)}.{module}"
    for topic, tests in TOPICS.items()
    for name, module in tests.items()
}
TOPIC = {name: topic for topic, tests in TOPICS.items() for name in tests}


@cache
def _test(name: str) -> case.ScalarTest:
    test: case.ScalarTest = import_module(f"{__package__}.{QUESTIONS[name]}").TEST
    return replace(test, topic=TOPIC[name])


class Catalogue(Mapping[str, case.ScalarTest]):
    """The table; a test is imported when it is asked for, so that a few are had without what all the others need."""

    def __getitem__(self, name: str) -> case.ScalarTest:
        return _test(name)

    def __iter__(self) -> Iterator[str]:
        return iter(QUESTIONS)

    def __len__(self) -> int:
        return len(QUESTIONS)


CATALOGUE = Catalogue()
