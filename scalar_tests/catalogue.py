"""Every scalar test by name: the table that `tracker run` goes through. A new test is a file and a line here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module

from spook_tracker.scalar_tests import case

QUESTIONS: dict[str, str] = {  # name of the test: the module that holds it as TEST
    # the thesis' seven continuous tests, in its order
    "beam": "beam.question",
    "door": "door.question",
    "falling_object": "falling_object",
    "friction": "inclined_plane.friction",
    "pendulum": "pendulum.question",
    "n_pendulum": "n_pendulum.question",
    "planetarium": "planetarium.question",
    # its other studies
    "cantilever": "cantilever.question",
    "slip_angle": "inclined_plane.slip_angle",
    "force_ratio": "inclined_plane.force_ratio",
    "slope_grid": "inclined_plane.slope_grid",
    "oscillator_spring": "oscillator.spring",
    "oscillator_row": "oscillator.row",
    "oscillator_damped": "oscillator.damped",
    "oscillator_filter": "oscillator.filter",
    # what it asks for next
    "bouncing_ball": "bouncing_ball",
    "bounce_grid": "bounce_grid",
    "blow": "blow",
    "between_walls": "between_walls",
    "billiards": "billiards",
    "cradle": "cradle",
    "near_miss": "near_miss",
    "solver_options": "solver_options",
    "edge_roll": "edge_roll",
    "overhang": "overhang",
    "leaning_cards": "leaning_cards",
    "card_house": "card_house",
    "rotating_box": "rotating_box",
    "thrown_die": "thrown_die",
    "steady_turns": "steady_turns",
    "swinging_door": "swinging_door",
    "lock_ring": "lock_ring",
    "resting_box": "resting_box",
    "resting_ball": "resting_ball",
    "resting_stack": "resting_stack",
    "resting_grid": "resting_grid",
    "rolling_sphere": "rolling_sphere",
    "pile": "pile",
    "falling_pile": "falling_pile",
    "hanging_chain": "hanging_chain.question",
    "loaded_rods": "loaded_rods",
    "spinning_top": "spinning_top",
    "motor": "motor",
    "double_pendulum": "double_pendulum",
    "floating_box": "floating_box",
    "rolling_log": "rolling_log",
    "sinking_sphere": "sinking_sphere",
    "wires": "wires",
    "capstan": "capstan",
    "scissor_lift": "scissor_lift",
    "gears": "gears",
    "robot_arm": "robot_arm",
    "arm_path": "arm_path",
    "conveyor": "conveyor",
    "turntable": "turntable",
    "sorting": "sorting",
    "rolling_friction": "rolling_friction",
    "grain": "grain",
    "masonry_arch": "masonry_arch",
    "stone_bridge": "stone_bridge",
    "vehicle": "vehicle",
    "climb": "climb",
    "suspension": "suspension",
    "cornering": "cornering",
    "rolling_coin": "rolling_coin",
    "bowl": "bowl",
    "slider_crank": "slider_crank",
    "loose_bearing": "loose_bearing",
    "seams": "seams",
    "grasp": "grasp",
    "hanging_cable": "hanging_cable",
    "taut_rope": "taut_rope",
    "rope": "rope",
    "falling_chain": "falling_chain",
    "rocking_block": "rocking_block",
    "shaken_block": "shaken_block",
    # what was measured
    "oblique_impact": "measured.oblique_impact",
    "bar_pendulum": "measured.bar_pendulum",
    "seconds_pendulum": "measured.seconds_pendulum",
    "last_bounce": "measured.last_bounce",
    "rolling_beats": "measured.rolling_beats",
    # the multibody benchmark library
    "simple_pendulum": "multibody.simple_pendulum",
    "four_bars": "multibody.four_bars",
    "squeezer": "multibody.squeezer",
    "bricard": "multibody.bricard",
    "governor": "multibody.governor",
}


class Catalogue(Mapping[str, case.ScalarTest]):
    """The table; a test is imported when it is asked for, so that a few are had without what all the others need."""

    def __getitem__(self, name: str) -> case.ScalarTest:
        test: case.ScalarTest = import_module(f"{__package__}.{QUESTIONS[name]}").TEST
        return test

    def __iter__(self) -> Iterator[str]:
        return iter(QUESTIONS)

    def __len__(self) -> int:
        return len(QUESTIONS)


CATALOGUE = Catalogue()
