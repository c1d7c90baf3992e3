"""JUnit XML for continuous integration: one suite per test, one case per value that is judged."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import spook_tracker.tracker.document.outside as outside
from spook_tracker.tracker.cli.report_compare import red_line
from spook_tracker.tracker.cli.report_table import limit, measured, pairs
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.comparison_document import CompareDocument
from spook_tracker.tracker.judge.standing import is_red
from spook_tracker.tracker.judge.tonight import Finding

ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def legal(text: str) -> str:
    """Text that XML 1.0 can hold, with nothing in it that cannot be seen."""
    return ILLEGAL.sub("\N{REPLACEMENT CHARACTER}", outside.clean(text))


def junit_of_run(run: RunDocument) -> str:
    """The judged values of a run."""
    cases = defaultdict(list)
    for definition, sample in pairs(run):
        if definition.role == "reported":
            continue
        words = f"{measured(definition, sample)}, limit {limit(definition)}"
        if not sample.set_point_held:
            words += ", set point left"
        failure = f"{words} {sample.failure}".strip() if is_red(definition, sample) else ""
        name = definition.key.partition("/")[2]
        cases[definition.test].append((name, failure, sample.outcome == "crashed"))
    return _document(dict(cases))


def junit_of_night(findings: Sequence[Finding]) -> str:
    """Every series of a night as judged against its history."""
    cases = defaultdict(list)
    for finding in findings:
        failure = f"{finding.name}: {finding.verdict.sentence}; {finding.blame}" if finding.red else ""
        sample = finding.judged.night.sample if finding.judged else None
        crashed = sample is not None and sample.outcome == "crashed"
        cases[finding.test].append((finding.series.partition("/")[2], failure, crashed))
    return _document(dict(cases))


def junit_of_comparison(document: CompareDocument) -> str:
    """Every series of a comparison; red ones fail, incomparable ones are skipped."""
    suites = Element("testsuites")
    groups = defaultdict(list)
    for change in document.changes:
        groups[change.test].append(change)
    for test, changes in sorted(groups.items()):
        suite = SubElement(suites, "testsuite", name=legal(test), tests=str(len(changes)))
        suite.set("failures", str(sum(change.red for change in changes)))
        for change in changes:
            name = change.series.partition("/")[2]
            case = SubElement(suite, "testcase", classname=legal(test), name=legal(name))
            if change.red:
                SubElement(case, "failure", message=legal(red_line(change)))
            elif change.word in ("not_comparable", "not_measured"):
                SubElement(case, "skipped", message=legal(change.sentence))
    return _text(suites)


def _document(cases: dict[str, list[tuple[str, str, bool]]]) -> str:
    suites = Element("testsuites")
    for test, found in cases.items():
        suite = SubElement(suites, "testsuite", name=legal(test), tests=str(len(found)))
        suite.set("failures", str(sum(bool(failure) and not crashed for _, failure, crashed in found)))
        suite.set("errors", str(sum(bool(failure) and crashed for _, failure, crashed in found)))
        for name, failure, crashed in found:
            case = SubElement(suite, "testcase", classname=legal(test), name=legal(name))
            if failure:
                SubElement(case, "error" if crashed else "failure", message=legal(failure))
    return _text(suites)


def _text(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + tostring(root, encoding="unicode") + "\n"
