"""The names that `from spook_tracker import tracker` offers, as a script uses them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from spook_tracker import engine, tracker
from spook_tracker.tracker import library

NIGHT = """
from pathlib import Path
from spook_tracker import tracker

document = tracker.run(["falling_object"], workers=0, apart=False)
tracker.record(document, "sqlite:///t.db")
tracker.record(tracker.run(["falling_object"], workers=0, apart=False), "sqlite:///t.db")
with tracker.History.open("sqlite:///t.db") as history:
    print(tracker.compare(history, "previous", "latest").exit_code)
    print(len(tracker.judge_run(history, "latest")) > 0)
    print(tracker.publish(history, Path("public"), options=tracker.SiteOptions(title="Mine")).failed)
print(tracker.nightly("sqlite:///t.db", Path("public"), catalogue="falling:CATALOGUE", apart=False).red)
options: tracker.RunOptions = {"sweep": False}
print(sorted(name for name in tracker.__all__ if not callable(getattr(tracker, name))))
"""


def test_every_public_name_works_after_every_other(tmp_path: Path) -> None:
    """`tracker.judge` was a function until the room of that name was imported, by the first comparison."""
    (tmp_path / "falling.py").write_text(
        "from spook_tracker.scalar_tests.catalogue import CATALOGUE as ALL\n"
        "CATALOGUE = {'falling_object': ALL['falling_object']}\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", NIGHT], cwd=tmp_path, capture_output=True, text=True, check=False
    )

    assert tracker.__all__ == library.__all__
    assert ran.stdout.split() == ["0", "True", "()", "False", "[]"], ran.stderr


@pytest.mark.parametrize(
    ("option", "right"), [("worker", "did you mean 'workers'?"), ("zzz", "there are 'catalogue', 'engine'")]
)
def test_a_misspelt_option_is_told_the_right_one(option: str, right: str) -> None:
    with pytest.raises(TypeError, match="a run has no option") as refused:
        tracker.run(["falling_object"], **{option: 1})  # type: ignore[misc]

    assert right in str(refused.value)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: tracker.SiteOptions(colours="#123456"), "SiteOptions has no 'colours'; did you mean 'colour'"),
        (lambda: tracker.publish(None, Path(), option=None), "publish has no 'option'; did you mean 'options'"),
        (lambda: tracker.judge_run(None, "latest", accept=()), "judge_run has no 'accept'; did you mean 'accepted'"),
        (lambda: tracker.judge_run(None), "judge_run needs run: write judge_run(history=…, run=…)"),
        (lambda: tracker.compare(None, "a", "b", accepts=()), "compare has no 'accepts'; did you mean 'accepted'"),
        (lambda: tracker.record(None, databse=""), "record has no 'databse'; did you mean 'database'"),
        (lambda: engine.simulate(None, time_steps=1), "simulate has no 'time_steps'; did you mean 'time_step'"),
        (lambda: engine.simulate(None, 0.01), "simulate takes only scene by place: write simulate(scene=…, time_step=…)"),
        (lambda: engine.prepare(None, time_step=1, observed={}), "prepare has no 'observed'; did you mean 'observe'"),
        (lambda: engine.start(None), "start needs time_step: write start(scene=…, time_step=…)"),
        (lambda: engine.compile(None, methods=None), "compile has no 'methods'; did you mean 'method'"),
    ],
)  # fmt: skip
def test_a_misspelt_option_of_every_function_and_of_the_site_is_told_the_right_one(
    call: Callable[[], object], sentence: str
) -> None:
    with pytest.raises(TypeError) as refused:
        call()

    assert str(refused.value).startswith(sentence)
