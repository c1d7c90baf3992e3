"""Where a run happens: the same here and now, different where it matters, and counters where they exist."""

from __future__ import annotations

import math

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
