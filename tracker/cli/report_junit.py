"""JUnit XML for continuous integration: one suite per test, one case per value that is judged."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import spook_tracker.tracker.document.outside as outside
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.comparison_document import Change, CompareDocument
from spook_tracker.tracker.judge.events import in_full
from spook_tracker.tracker.judge.standing import FOLLOWED, is_red
from spook_tracker.tracker.judge.tonight import Finding
from spook_tracker.tracker.judge.vocabulary import WORSE_THAN_EXPECTED

from .report_compare import red_line, where
from .report_table import limit, measured, pairs

if TYPE_CHECKING:
    from spook_tracker.tracker.past import OldAnswers

ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class Case(NamedTuple):
    """One value that is judged."""

    name: str
    failure: str = ""  # what is wrong with it
    crashed: bool = False
    skipped: str = ""  # why nothing can be said of it
    said: str = ""  # of one that passes


def legal(text: str) -> str:
    """Text that XML 1.0 can hold, with nothing in it that cannot be seen, or is run where it is printed."""
    return ILLEGAL.sub("\N{REPLACEMENT CHARACTER}", outside.inert(outside.clean(text)))


def junit_of_run(run: RunDocument) -> str:
    """The judged values of a run."""
    cases = defaultdict(list)
    for definition, sample in pairs(run):
        if definition.role in FOLLOWED:
            continue
        words = f"{measured(definition, sample)}, limit {limit(definition)}"
        if not sample.set_point_held:
            words += ", set point left"
        failure = f"{words} {sample.failure}".strip() if is_red(definition, sample) else ""
        name = definition.key.partition("/")[2]
        cases[definition.test].append(Case(name, failure, sample.outcome == "crashed"))
    return _document(cases)


def junit_of_night(findings: Sequence[Finding], then: Sequence[OldAnswers] = ()) -> str:
    """Every series of a night as judged against its history.

    After them, of `then` (tracker.past.OldAnswers), those by old questions; what cannot be told is skipped.
    """
    cases = defaultdict(list)
    for finding in findings:
        failure = f"{in_full(finding.name, finding.verdict.sentence)}; {finding.blame}" if finding.red else ""
        sample = finding.judged.night.sample if finding.judged else None
        crashed = sample is not None and sample.outcome == "crashed"
        what = (
            "recovered" if finding.recovered else WORSE_THAN_EXPECTED if finding.worse_than_expected else ""
        )
        said = f"{what}: {finding.verdict.sentence}" if what else ""
        where = f" on {finding.machine}" if finding.machine else ""
        cases[finding.test].append(
            Case(finding.series.partition("/")[2] + where, failure, crashed, said=said)
        )
    for old in then:
        asked = f" as asked at {old.commit[:12] or 'no commit'}"
        for change in old.changes:
            cases[change.test].append(_of_change(change, asked))
    return _document(cases)


def junit_of_comparison(document: CompareDocument) -> str:
    """Every series of a comparison; red ones fail, incomparable ones are skipped, and what was left out is said at the end."""
    cases = defaultdict(list)
    for change in document.changes:
        cases[change.test].append(_of_change(change))
    return _document(dict(sorted(cases.items())), document.notes)


def _of_change(change: Change, asked: str = "") -> Case:
    return Case(
        name=where(change).partition("/")[2] + asked,
        failure=red_line(change) if change.red else "",
        skipped=change.sentence if change.word in ("not_comparable", "not_measured") else "",
    )


def _document(cases: Mapping[str, Sequence[Case]], notes: Sequence[str] = ()) -> str:
    suites = Element("testsuites")
    for test, found in cases.items():
        suite = SubElement(suites, "testsuite", name=legal(test), tests=str(len(found)))
        suite.set("failures", str(sum(bool(one.failure) and not one.crashed for one in found)))
        suite.set("errors", str(sum(bool(one.failure) and one.crashed for one in found)))
        for one in found:
            case = SubElement(suite, "testcase", classname=legal(test), name=legal(one.name))
            if one.failure:
                SubElement(case, "error" if one.crashed else "failure", message=legal(one.failure))
            elif one.skipped:
                SubElement(case, "skipped", message=legal(one.skipped))
            elif one.said:
                SubElement(case, "system-out").text = legal(one.said)
    if notes:
        suite = SubElement(suites, "testsuite", name="notes", tests="0", failures="0", errors="0")
        SubElement(suite, "system-out").text = legal("\n".join(notes))
    return _text(suites)


def _text(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + tostring(root, encoding="unicode") + "\n"
