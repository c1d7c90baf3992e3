"""What things are called: every word a verdict may have, every class of a night, every name of an event.

One table each, and no other place says these words. Commands, pages, feed, badge, JUnit and Markdown take from
here the word, its mark, whether it is red and how bad it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

Word = Literal[
    "missing",
    "removed",
    "regressed",
    "non_deterministic",
    "accepted",
    "expected",
    "not_comparable",
    "fixed",
    "improved",
    "changed",
    "new",
    "not_measured",
    "same",
    "identical",
]
Class = Literal["fail", "watch", "accepted", "none", "pass", "followed"]
Overall = Literal["regressed", "not_comparable", "same", "identical"]  # of two versions compared
State = Literal["green", "detected", "accepted", "recovered", "suspected", "unjudged"]


@dataclass(frozen=True, slots=True)
class Said:
    """How a word is shown."""

    mark: str
    red: bool = False  # a person has to look
    quiet: bool = False  # not worth a line among changes


WORDS: dict[Word, Said] = {  # the worst first
    "missing": Said("✗", red=True),
    "removed": Said("✗", red=True),
    "regressed": Said("✗", red=True),
    "non_deterministic": Said("✗", red=True),
    "accepted": Said("!"),
    "expected": Said("!"),
    "not_comparable": Said("?"),
    "fixed": Said("✓"),
    "improved": Said("✓"),
    "changed": Said("·"),
    "new": Said("·"),
    "not_measured": Said("·", quiet=True),
    "same": Said("=", quiet=True),
    "identical": Said("=", quiet=True),
}
RED = frozenset(word for word, said in WORDS.items() if said.red)
QUIET = frozenset(word for word, said in WORDS.items() if said.quiet)
WORD_RANK = {word: rank for rank, word in enumerate(WORDS)}


@dataclass(frozen=True, slots=True)
class SaidOverall:
    """How a comparison as a whole is shown, and what its command ends with."""

    mark: str
    headline: str
    code: Literal[0, 1, 3]


OVERALL: dict[Overall, SaidOverall] = {  # the worst first
    "regressed": SaidOverall("✗", "Regressed", 1),
    "not_comparable": SaidOverall("?", "Not comparable", 3),
    "same": SaidOverall("✓", "No regression", 0),
    "identical": SaidOverall("✓", "Identical", 0),
}
CLASSES: dict[Class, tuple[str, str, str]] = {  # the worst first: mark, word, what it means
    "fail": ("✗", "FAIL", "a limit broken, a solve left unsettled, or no value"),
    "watch": ("!", "WATCH", "limits kept; a set point left, or worse than before"),
    "accepted": ("!", "ACCEPTED", "worse, and accepted with a name and a reason"),
    "none": ("·", "NO DATA", "not run"),
    "pass": ("✓", "PASS", "every limit kept, every set point held"),
    "followed": ("·", "FOLLOWED", "no expectation: only a change is told"),
}
CLASS_RANK = {name: rank for rank, name in enumerate(CLASSES)}
CALLED_WORSE = {  # what a growth of badness is called, by the kind of series
    "break_point": "less stable",
    "ladder": "less accurate",
    "order": "further from its order",
    "time": "slower",
    "work": "more work",
}
WORSE_THAN_EXPECTED = "worse than expected"  # the name of a failure that is expected, and became worse
STATES: dict[State, str] = {
    "green": "",
    "detected": "✗ red",
    "accepted": "! accepted",
    "recovered": "✓ recovered",
    "suspected": "? suspected",
    "unjudged": "",
}


def besides(states: Sequence[State]) -> str:
    """How many series recovered, and how many are slow and to be confirmed; empty if none."""
    words: list[tuple[State, str]] = [("recovered", "recovered"), ("suspected", "to be confirmed")]
    return "".join(f"; {count} {said}" for state, said in words if (count := states.count(state)))


def with_recoveries(states: Iterable[State]) -> Iterator[State]:
    """The states of a series, night after night, its first night after a red stretch recovered, and no other.

    A night without a verdict ends no stretch; a value that comes back is recovered, even if it is suspected to be slow.
    """
    red = False
    for state in states:
        if state == "recovered" or (red and state == "suspected"):
            state = "green"
        if state == "green" and red:
            state = "recovered"
        yield state
        red = state == "detected" or (red and state == "unjudged")


def spaced(word: str) -> str:
    """A word of a table as a reader wants it: not_comparable is "not comparable"."""
    return word.replace("_", " ")
