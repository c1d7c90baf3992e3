"""Where a run happens: the same here and now, different where it matters, and counters where they exist."""

from __future__ import annotations

import ctypes
import errno
import math

import pytest

import spook_tracker.tracker.measure.instructions as instructions
from spook_tracker.tracker.measure import machine as module
from spook_tracker.tracker.measure.instructions import InstructionCounter, can_count
from spook_tracker.tracker.measure.machine import float_environment, machine


def test_the_same_machine_has_the_same_fingerprint_and_environment():
    assert machine() == machine()
    assert machine().cores >= 1
    assert machine().processor


def test_another_processor_has_another_fingerprint(monkeypatch):
    here = machine()
    monkeypatch.setattr(module, "_processor", lambda: "another")

    assert machine().fingerprint != here.fingerprint
    assert machine().float_environment == here.float_environment


RUNNER = ("ImageOS", "ImageVersion", "CI_DISPOSABLE_ENVIRONMENT", "CI_JOB_IMAGE")


def hosted(patch: pytest.MonkeyPatch, **said: str):
    for name in RUNNER:
        patch.delenv(name, raising=False)
    for name, value in said.items():
        patch.setenv(name, value)
    return machine()


def test_a_hosted_runner_is_known_by_its_image_and_says_that_it_may_be_any_host(monkeypatch):
    own = hosted(monkeypatch)
    first = hosted(monkeypatch, ImageOS="ubuntu24", ImageVersion="20260101.1")
    later = hosted(monkeypatch, ImageOS="ubuntu24", ImageVersion="20260108.1")
    other = hosted(monkeypatch, ImageOS="ubuntu22", ImageVersion="20260101.1")

    assert len({found.fingerprint for found in (own, first, other)}) == 3
    assert first.fingerprint == later.fingerprint
    assert first.processor == f"{own.processor}, any machine of the runner image ubuntu24"
    assert (first.operating_system, later.operating_system) == (
        f"{own.operating_system} ubuntu24 20260101.1",
        f"{own.operating_system} ubuntu24 20260108.1",
    )


def test_a_container_names_the_machine_only_where_the_runner_is_thrown_away(monkeypatch):
    own = hosted(monkeypatch)

    assert hosted(monkeypatch, CI_JOB_IMAGE="python:3.12") == own
    assert (
        "python:3.12"
        in hosted(monkeypatch, CI_JOB_IMAGE="python:3.12", CI_DISPOSABLE_ENVIRONMENT="true").processor
    )
    assert hosted(monkeypatch, ImageOS="two\nlines") == own


def test_one_bit_of_one_library_function_is_another_float_environment(monkeypatch):
    here = float_environment()
    changed = tuple(
        (lambda x: math.nextafter(math.sin(x), 2.0)) if function is math.sin else function
        for function in module.LIBRARY
    )
    monkeypatch.setattr(module, "LIBRARY", changed)

    assert float_environment() != here


def test_instructions_are_counted_or_none():
    counter = InstructionCounter()
    with counter.counting():
        sum(range(1000))
    counter.close()

    if can_count():
        assert counter.count > 1000
    else:
        assert not counter.count


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (errno.EACCES, "the kernel does not allow it here (kernel.perf_event_paranoid is "),
        (errno.ENOENT, "the processor shows no counter, as in most virtual machines"),
        (errno.ENOSYS, "the kernel refuses: "),
    ],
)
def test_why_instructions_are_not_counted_is_said(
    monkeypatch: pytest.MonkeyPatch, error: int, words: str
) -> None:
    class Refusing:
        @staticmethod
        def syscall(*_: object) -> int:
            ctypes.set_errno(error)
            return -1

    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Refusing)
    instructions.why_not.cache_clear()
    try:
        assert instructions.why_not().startswith(words)
        assert not instructions.can_count()
        assert InstructionCounter().count is None
    finally:
        instructions.why_not.cache_clear()


def test_the_counter_counts_what_the_kernel_lets_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock of the task stands in for the processor's counter, which virtual machines do not show."""
    software, task_clock = 1, 1
    monkeypatch.setattr(instructions, "HARDWARE", software)
    monkeypatch.setattr(instructions, "RETIRED_INSTRUCTIONS", task_clock)
    counter = InstructionCounter()
    if counter.count is None:
        pytest.skip(f"no perf events here: {instructions._open()[1]}")
    with counter.counting():
        sum(range(10_000))
    few = counter.count
    with counter.counting():
        sum(range(1_000_000))
    counter.close()

    assert counter.count > 5 * few > 0
