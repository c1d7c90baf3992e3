"""Every limit and set point of ours is rounding, found again by a test without the engine, or called a choice."""

from __future__ import annotations

import importlib
import inspect
import math
import re
from typing import Any

import pytest

from spook_tracker.scalar_tests.case import Metric
from spook_tracker.scalar_tests.catalogue import CATALOGUE

ROUNDING = (
    1e-7  # a closed form, a kept quantity or statics to so much: what rounding and a solver's tolerance leave
)
CHOICES = {("pile", "overlap")}  # no theory: what would still be called a pile at rest
L, C, M, F, S, E = (
    f"tests.scalar_tests.test_{name}"
    for name in ("limits", "contact_limits", "machine_limits", "found_limits", "string_limits", "contacts")
)
PROTOTYPE = f"{L}.test_the_dense_prototype_gives_what_is_published"
CHAIN = f"{L}.test_the_chain_prototype_gives_what_is_published"
ORBIT = f"{L}.test_the_orbit_errs_as_its_map_iterated_by_itself"
SMALL = f"{L}.test_string_stiffness_costs_what_its_map_of_small_motion_costs"
BENT = f"{F}.test_the_cantilever_bends_as_large_deflection_has_it"
BALL = f"{F}.test_a_discrete_ball_bounces_as_high_and_as_long_as_the_limits_allow"
RIGID = f"{F}.test_the_rigid_prototype_gives_the_first_step_of_the_door"
A = "tests.scalar_tests.test_arm_limits"
LAGS = f"{M}.test_cranks_and_pins_lag_as_damped_rows_do_and_run_ahead_by_the_turn_of_a_step"
CLIMB = f"{C}.test_a_driven_vehicle_climbs_by_newton_and_slips_when_its_friction_is_used_up"
BLOW = "tests.scalar_tests.test_rocking_limits.test_a_step_that_holds_an_impact_keeps_as_much_as_the_limits_allow"
METACENTRE = f"{M}.test_a_small_roll_rights_itself_with_its_metacentre_and_a_little_more"
SEARCH = f"{F}.test_a_search_is_as_exact_as_its_resolution"
RODS = f"{F}.test_loaded_rods_swing_as_their_modes_do_step_by_step"
EDGE = f"{E}.test_the_limit_at_the_edge_is_that_of_its_own_step"
WAVE = f"{M}.test_a_discrete_oscillation_is_shorter_by_the_cube_of_its_step"
ARCH = f"{C}.test_an_arch_is_as_thin_as_limit_analysis_allows"
BRIDGE = f"{C}.test_a_bridge_carries_what_limit_analysis_allows"
BEND = f"{M}.test_a_bend_passes_on_what_a_tyre_takes_its_speed_too_large_by"
COIN = "tests.scalar_tests.test_coin_limits.test_a_coin_in_steps_is_left_with_the_square_of_its_own_turn"
BOWL = f"{M}.test_many_facets_make_a_round_bowl_and_few_of_them_slow_a_ball_down_at_corners"
R = "tests.scalar_tests.test_robot_limits"
PUSH = f"{R}.test_box_push_is_late_by_two_steps_and_its_hand_by_what_damped_rows_let_through"
TURNING = f"{M}.test_a_turning_rope_is_longer_by_what_its_damped_rows_let_through"

FOUND = {  # test: metric: what finds it again without the engine
    "beam": {"sag_error": f"{F}.test_a_beam_of_compliant_locks_sags_by_its_stiffness_matrix"},
    "door": {"weight_error": RIGID, "sideways_sum": RIGID},
    "falling_object": {"position_error_read_late": f"{F}.test_the_fall_read_a_sample_late_is_a_sum"},
    "pendulum": dict.fromkeys(
        ("length_deviation", "energy_deviation", "energy_at_the_end", "tension_at_the_bottom", "period_error"), PROTOTYPE
    ),
    "n_pendulum": dict.fromkeys(
        ("length_deviation", "length_deviation_early", "energy_at_10_s", "energy_at_the_end", "energy_gain"), CHAIN
    ),
    "planetarium": {
        "energy_oscillation": ORBIT,
        "radius_error": ORBIT,
        "position_error": ORBIT,
        "energy_oscillation_as_printed": f"{F}.test_the_printed_energy_swings_by_symplectic_euler_and_less_on_the_exact_orbit",
    },
    "cantilever": {
        "tip_against_linear": BENT,
        "tip_against_elastica": f"{L}.test_a_cantilever_of_pieces_differs_from_the_elastica_by_its_own_statics",
        "self_weight_ratio": BENT,
    },
    "simple_pendulum": {"library_error": f"{F}.test_a_pendulum_keeps_its_time_for_2000_s_by_high_orders_alone"},
    "slip_angle": dict.fromkeys(
        ("slip_slope_error", "bracket_held"), f"{F}.test_the_slope_at_which_a_box_slips_is_as_well_known_as_it_is_searched"
    ),
    "oscillator_damped": {"against_continuum": f"{L}.test_damping_leaves_the_continuum_as_far_as_the_map_does"},
    "bouncing_ball": dict.fromkeys(("height_error", "stop_time_error", "rest_gap", "energy_gain"), BALL),
    "edge_roll": dict.fromkeys(("sliding_error", "rolling_spin_error"), EDGE),
    "card_house": {
        "least_error": SEARCH
    },
    "rotating_box": {
        "flip_time_error": f"{F}.test_flips_are_found_as_well_as_a_straight_line_between_samples_allows"
    },
    "swinging_door": dict.fromkeys(("period_error", "energy_deviation", "hinge_violation"), PROTOTYPE),
    "pile": {
        "missing_load": "tests.scalar_tests.test_pile_limits.test_the_limit_of_a_pile_is_that_of_its_springs",
    },
    "hanging_chain": {
        "path_error": SMALL,
        "energy_lost": SMALL,
        "energy_gain": SMALL,
        "energy_cost": f"{L}.test_string_stiffness_costs_next_to_nothing_where_it_is_not_needed",
    },
    "loaded_rods": dict.fromkeys(("period_error", "width_change"), RODS),
    "spinning_top": dict.fromkeys(("path_error", "rate_error", "nutation", "energy_deviation", "joint_violation"), PROTOTYPE),
    "motor": {"angle_lead": f"{M}.test_the_motor_leads_by_the_sum_of_the_turns_of_its_steps"},
    "double_pendulum": {"angle_error": f"{L}.test_the_double_pendulum_may_be_half_a_step_off"},
    "floating_box": {"period_error": WAVE},
    "rolling_log": {"roll_rate_error": METACENTRE, "continuous_error": METACENTRE},
    "arm_path": {
        "torque_error": f"{A}.test_torques_of_a_guided_arm_are_two_steps_late_at_most",
        "path_error": f"{A}.test_an_arm_led_by_torques_strays_as_steps_of_its_joints_do",
        "fall_error": f"{A}.test_two_weak_joints_fall_as_steps_of_theirs_do",
        "held_error": f"{A}.test_two_weak_joints_fall_as_steps_of_theirs_do",
    },
    "falling_chain": {"sunk": f"{S}.test_an_end_that_turns_comes_in_by_what_its_path_bends_in_a_step"},
    "box_push": dict.fromkeys(("torque_error", "push_error", "place_error"), PUSH),
    "latch": {"opening_error": f"{R}.test_a_nose_goes_back_as_the_door_gains_energy"},
    "sinking_sphere": {"swing_error": WAVE},
    "climb": dict.fromkeys(("speed_error", "spin_error", "transfer_error"), CLIMB),
    "slider_crank": dict.fromkeys(("place_error", "torque_error"), LAGS),
    "loose_bearing": dict.fromkeys(("place_error", "flight_error", "stuck_error"), LAGS),
    "rocking_block": dict.fromkeys(("kept_error", "first_blow_late", "swing_error"), BLOW),
    "shaken_block": dict.fromkeys(("after_error", "before_error", "blow_late"), BLOW),
    "vehicle": dict.fromkeys(
        ("speed_error", "spin_error", "sideways", "transfer_error", "load_error", "stopping_error", "stands"),
        f"{C}.test_the_loads_of_a_braking_vehicle_balance_its_moments",
    ),
    "robot_arm": {"driving_error": f"{M}.test_the_torques_of_a_driven_arm_are_two_steps_late_at_most"},
    "rolling_coin": dict.fromkeys(("rate_error", "lean_error", "centre_error", "energy_error"), COIN),
    "turntable": {"rate_error": f"{C}.test_the_ball_on_a_turntable_lags_by_the_tangent_of_its_turn"},
    "sorting": {"steps_late": f"{F}.test_a_box_on_the_belt_is_late_by_a_whole_step_or_not_at_all"},
    "masonry_arch": dict.fromkeys(("stands", "falls", "weight_error", "thrust"), ARCH),
    "stone_bridge": dict.fromkeys(("stands", "falls", "weight_error", "thrust", "stays"), BRIDGE),
    "suspension": {
        "pitch_error": "tests.scalar_tests.test_chassis_limits.test_a_pitch_is_slower_by_what_an_integration_of_the_plane_finds",
        "continuous_error": f"{F}.test_a_bounce_in_steps_is_faster_than_the_continuum_by_its_limit",
    },
    "cornering": dict.fromkeys(("yaw_error", "front_error", "slowed"), BEND),
    "bowl": dict.fromkeys(("period_error", "smooth_error", "place_error", "slip"), BOWL),
    "hanging_cable": {
        "catenary_error": f"{S}.test_links_pull_less_than_a_smooth_cable_by_the_midpoint_rule",
    },
    "last_bounce": {
        "theory_error": "tests.scalar_tests.test_measured.test_the_limit_of_the_last_bounce_is_a_step_for_each_bounce_that_is_heard",
    },
    "taut_rope": dict.fromkeys(
        ("mode_error", "speed_error"), f"{S}.test_modes_of_a_taut_rope_are_the_eigenvalues_of_its_links"
    ),
    "rope": {
        "pull_error": TURNING,
        "energy_error": TURNING,
        "cost_error": f"{F}.test_the_ends_of_a_rope_cost_a_link_in_125",
    },
}  # fmt: skip


def widths(metric: Metric) -> list[float]:
    """What of a metric is ours to derive: how far its limit and its set point let a value go (rad for degrees)."""
    found, unit = [], math.pi / 180.0 if metric.unit == "degrees" else 1.0
    if metric.limit is not None and metric.limit_kind != "physical":
        if isinstance(metric.limit, tuple):
            found.append(0.5 * (metric.limit[1] - metric.limit[0]))
        elif metric.better in ("larger", "smaller") and metric.reference != 0.0:
            whole = (
                round(metric.limit) if metric.reference is None else metric.reference
            )  # a count, or a share of one
            found.append(abs(metric.limit - whole))
        else:
            found.append(abs(metric.limit))
    if metric.set_point is not None:
        found.append(0.5 * (metric.set_point[1] - metric.set_point[0]))
    return [unit * width for width in found]


OURS = sorted(
    {
        (name, metric.name)
        for name, test in CATALOGUE.items()
        for asked in test.measurements
        for metric in asked.metrics
        if max(widths(metric), default=0.0) > ROUNDING
    }
)


def test_a_limit_on_one_side_is_as_wide_as_it_is_far_from_what_it_shall_be() -> None:
    def wide(limit: Any, **facts: Any) -> float:
        facts = {"unit": "1", "better": "smaller_magnitude"} | facts
        return max(
            widths(Metric(name="n", description="d", role="gate", limit=limit, limit_source="s", **facts))
        )

    assert wide(0.25) == 0.25
    assert wide((-0.5, 1.5)) == 1.0
    assert wide(180.0, unit="degrees") == pytest.approx(math.pi)
    assert wide(0.6, better="larger", reference=1.0) == pytest.approx(0.4)
    assert wide(1.4, better="smaller", reference=1.0) == pytest.approx(0.4)
    assert wide(0.6, better="larger") > ROUNDING  # its value is not given
    assert wide(3.0, better="larger") == 0.0  # a count: all of three
    assert wide(1.0 + 1e-9, better="smaller") < ROUNDING
    assert wide(0.0, set_point=(-0.1, 0.1), set_point_source="s") == pytest.approx(0.1)


@pytest.mark.parametrize(("test", "name"), OURS)
def test_every_limit_of_ours_is_found_again_or_called_a_choice(test: str, name: str) -> None:
    if (test, name) in CHOICES:
        metrics = [m for asked in CATALOGUE[test].measurements for m in asked.metrics if m.name == name]
        assert all(m.limit_source.startswith("a choice: ") for m in metrics)
        return
    assert name in FOUND.get(test, {}), f"nothing finds the limit of {test} {name} again without the engine"
    module, _, function = FOUND[test][name].rpartition(".")
    told = inspect.getsource(getattr(importlib.import_module(module), function))

    assert re.search(rf"\b{test}\b", told), f"{function} does not ask about {test}"
    assert "measurement" in told or "metric" in told or "limit" in told, f"{function} looks at no limit"


def test_no_limit_is_listed_that_is_not_there() -> None:
    asked = {
        (name, metric.name)
        for name, test in CATALOGUE.items()
        for one in test.measurements
        for metric in one.metrics
    }

    assert {(test, name) for test, names in FOUND.items() for name in names} <= asked


def test_what_is_called_rounding_says_where_it_is_from() -> None:
    for test in CATALOGUE.values():
        for asked in test.measurements:
            for metric in asked.metrics:
                if metric.limit is not None and metric.limit_kind != "physical":
                    assert metric.limit_source, metric.name
