"""Which series are asked about: by test, by kind, by role. What is left out is neither shown nor counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence, Sized
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

import msgspec

from spook_tracker.tracker.document.errors import UnknownName

from .vocabulary import CLASS_RANK

if TYPE_CHECKING:
    from .comparison_document import Change, CompareDocument
    from .maps import ToldMap
    from .series_history import Told
    from .tonight import Finding

OF_MAP = ("map", "companion")  # kind and role of a stability map


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Series to be told of; of what names nothing, all."""

    tests: tuple[str, ...] = ()  # names, * for anything
    kinds: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()

    def takes(self, test: str, kind: str, role: str) -> bool:
        """Whether a series of that test, kind and role is among them."""
        return (
            (not self.tests or any(fnmatchcase(test, name) for name in self.tests))
            and (not self.kinds or kind in self.kinds)
            and (not self.roles or role in self.roles)
        )

    def __str__(self) -> str:
        asked = (("test", self.tests), ("kind", self.kinds), ("role", self.roles))
        return " ".join(f"--{name} {value}" for name, values in asked for value in values)

    def _some(self, chosen: Sized, among: Sized) -> None:
        if among and not chosen:
            raise UnknownName(f"none of {len(among)} series fits {self}; ask for fewer things at once")

    def of_findings(self, findings: Sequence[Finding]) -> list[Finding]:
        """Those of a night."""
        chosen = [
            finding
            for finding in findings
            if self.takes(
                finding.test,
                *((finding.definition.kind, finding.definition.role) if finding.definition else OF_MAP),
            )
        ]
        self._some(chosen, findings)
        return chosen

    def of_trends(self, told: Sequence[Told]) -> list[Told]:
        """Those of some histories."""
        chosen = [t for t in told if self.takes(t.definition.test, t.definition.kind, t.definition.role)]
        self._some(chosen, told)
        return chosen

    def of_maps(self, told: Sequence[ToldMap]) -> list[ToldMap]:
        """Those of some maps; there may be none."""
        return [t for t in told if self.takes(t.newest.test, *OF_MAP)]

    def of_comparison(self, document: CompareDocument) -> CompareDocument:
        """The comparison of those alone, with a verdict of its own."""
        if self == Choice():
            return document
        from .compare import exit_code, overall

        changes = tuple(c for c in document.changes if self.takes(c.test, c.kind, c.role))
        self._some(changes, document.changes)
        tests = {change.test for change in changes}
        verdict = overall(changes)
        return msgspec.structs.replace(
            document,
            changes=changes,
            verdict=verdict,
            exit_code=exit_code(verdict),
            counts=dict(Counter(change.word for change in changes)),
            frontiers=tuple(frontier for frontier in document.frontiers if frontier.test in tests),
        )


def worst_change(document: CompareDocument) -> Change | None:
    """The red change a reader should see first: FAIL before WATCH, gates first, then what grew most."""
    reds = [change for change in document.changes if change.red]

    def rank(change: Change) -> tuple[int, bool, float, str]:
        return CLASS_RANK[change.stands], change.role != "gate", -(change.decades or 0.0), change.series

    return min(reds, key=rank, default=None)
