"""What a release changed of a model is said with body, quantity, time and size."""

from __future__ import annotations

from spook_tracker.tracker.judge.model_words import Moved, first_look, severity, words


def moved(metric: str, before: float, after: float, much: str = "", unit: str = "m") -> Moved:
    return Moved(metric=metric, unit=unit, before=before, after=after, severity=much)


def test_a_rest_is_told_by_body_as_higher_aside_and_turned() -> None:
    found = words(
        [
            moved("bowl.rest_z", 0.5, 0.413, "40 times what halving the time step changes"),
            moved("bowl.rest_x", 0.0, 0.003),
            moved("bowl.rest_y", 0.0, 0.004),
            moved("bowl.rest_turn", 0.1, 0.2, unit="rad"),
            moved("ramekin.rest_z", 0.1, 0.101),
        ]
    )

    assert found[0] == (
        "bowl rests 0.087 m lower and 0.005 m aside and turned by 0.1 rad more (40 times what halving the time step changes)"
    )
    assert found[1] == "ramekin rests 0.001 m higher"


def test_a_first_look_says_how_it_ends_how_long_it_is_known_and_what_it_costs() -> None:
    values = {"settled": 1.84, "predictable_time": 5.0, "step_time": 2.5e-5, "real_time_factor": 400.0}

    assert first_look(values) == (
        "rests from 1.84 s on; can be predicted for 5 s; 25 µs a step, 400 times real time"
    )
    assert first_look({"predictable_time": 0.3}, "still moves at 2 m/s after 10 s") == (
        "still moves at 2 m/s after 10 s; can be predicted for 0.3 s"
    )
    assert first_look({}) == ""


def test_a_motion_is_told_from_when_on_and_how_far_it_went() -> None:
    (found,) = words(
        [
            moved("left.foot.place@0.05s", 0.1, 0.1001),
            moved("torso.place@0.05s", 0.1, 0.1005, "2 times"),
            moved("torso.place@5s", 1.0, 1.5),
        ]
    )

    assert (
        found
        == "moves otherwise from 0.05 s on: torso by 0.0005 m at 0.05 s (2 times); torso by 0.5 m at 5 s"
    )


def test_more_bodies_than_three_are_counted() -> None:
    found = words([moved(f"b{k}.rest_z", 0.0, 1.0 - 0.1 * k) for k in range(5)])

    assert len(found) == 3
    assert found[-1].endswith("and so do 2 more bodies")


def test_what_changed_for_the_whole_and_what_became_of_it() -> None:
    found = words(
        [
            moved("settled", 1.0, 2.5, unit="s"),
            moved("a.mean_place", 1.00001, 1.00002),
            Moved(metric="a.rest_x", unit="m", before=0.0, after=0.0, became="value became diverged"),
        ]
    )

    assert found == [
        "a.rest_x and its like: value became diverged",
        "a ends 1.00002 m from its start in the mean over small pushes, not 1.00001 m",
        "settles at 2.5 s, not at 1 s",
    ]


def test_the_severity_is_what_the_judge_says_after_the_distance() -> None:
    assert severity("moved by 1e-3 m: 40 times what halving the time step changes, 0.1 of the size") == (
        "40 times what halving the time step changes, 0.1 of the size"
    )
    assert severity("moved by 1e-3 m") == ""
