"""junit.xml, as GitLab, GitHub's reporters and Jenkins read it (the schema: junit-10.xsd of Jenkins' xUnit plugin).

GitLab shows the text of `failure` and `skipped`, Jenkins and GitHub their `message`: both say it. A case has one `failure`.
Times are simulated, so that two lockstep runs write the same bytes; of real drives they are the wall clock's.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path
from xml.etree import ElementTree as ET

from drivetwin.foundation.files import new_file
from drivetwin.hil_tests.folder import BUS_LOG, CONTROLLER_LOG, VERDICT
from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.results.results_file import BenchPart, bench_part
from drivetwin.hil_tests.results.trend import Kind, Trend
from drivetwin.hil_tests.results.wording import caveats, failure_words, measured_words, suite_name
from drivetwin.hil_tests.verdict import CaseResult, Outcome

ATTACHED = (BUS_LOG, CONTROLLER_LOG, VERDICT)
"""Files of a case that are named as its attachments where they are there; GitLab takes the first."""

TREND = "trend"
"""The suite of what has changed since the baseline."""

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 (2.2, Char) cannot hold."""


def write_junit(acceptance: Acceptance, path: Path, workspace: Path, trend: Trend | None = None) -> None:
    """Write the cases as JUnit XML, one suite a group and one for the trend, whole or not at all.

    Attachments are named relative to `workspace`, the directory of the CI's job (GitLab's CI_PROJECT_DIR, Jenkins' WORKSPACE).
    """
    bench = bench_part(acceptance.bench)
    root = ET.Element("testsuites", {"name": "acceptance"})
    for name, cases in groupby(acceptance.cases, key=suite_name):
        root.append(_suite(name, bench, [_case(case, workspace) for case in cases]))
    if trend is not None:
        root.append(_suite(TREND, bench, [_kept(trend)]))
    root.attrib |= _totals(root)
    ET.indent(root)
    with new_file(path) as part:
        ET.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)


def _suite(name: str, bench: BenchPart, cases: Iterable[ET.Element]) -> ET.Element:
    suite = ET.Element("testsuite", {"name": name})
    properties = ET.SubElement(suite, "properties")
    for key in ("controller", "machine", "profile", "drives", "bus", "clock", "seed"):
        ET.SubElement(properties, "property", {"name": key, "value": _text(str(getattr(bench, key)))})
    suite.extend(cases)
    suite.attrib |= _totals(suite) | {"skipped": str(len(suite.findall("testcase/skipped")))}
    return suite


def _totals(parent: ET.Element) -> dict[str, str]:
    """Of the test cases below an element."""
    cases = list(parent.iter("testcase"))
    failures, seconds = len(list(parent.iter("failure"))), sum(float(case.get("time", "0")) for case in cases)
    return {"tests": str(len(cases)), "failures": str(failures), "errors": "0", "time": f"{seconds:.3f}"}


def _case(case: CaseResult, workspace: Path) -> ET.Element:
    attributes = {"classname": suite_name(case), "name": case.name, "time": f"{case.simulated:.3f}"}
    element = ET.Element("testcase", {key: _text(value) for key, value in attributes.items()})
    if case.outcome is Outcome.REJECTED:
        lines = [failure_words(failure) for failure in case.failures]
        element.append(_failure([f"{case.title}.", f"Requirement: {case.requirement}"], lines or ["rejected"]))
    if case.outcome is Outcome.SKIPPED:
        _said(element, "skipped", case.skipped_because).set("message", _text(case.skipped_because))
    _said(element, "system-out", "\n".join(_out_lines(case, workspace)))
    return element


def _kept(trend: Trend) -> ET.Element:
    """The case that nothing has become worse, without which a run that the trend rejects would look accepted."""
    element = ET.Element("testcase", {"classname": TREND, "name": "nothing_worse_than_before", "time": "0.000"})
    if trend.rejects:
        lines = [change.words for change in trend.of(Kind.REGRESSION)]
        element.append(_failure([f"Worse than {trend.controller} by more than noise:"], lines))
    return element


def _failure(heading: Sequence[str], lines: Sequence[str]) -> ET.Element:
    more = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
    element = ET.Element("failure", {"type": "requirement", "message": _text(lines[0] + more)})
    element.text = _text("\n".join([*heading, *lines]))
    return element


def _out_lines(case: CaseResult, workspace: Path) -> Iterable[str]:
    yield case.title
    yield from (measured_words(measured) for measured in case.measured)
    yield from caveats(case)
    for file in ATTACHED:
        if case.folder is not None and (case.folder / file).is_file():
            yield f"[[ATTACHMENT|{Path(os.path.relpath(case.folder / file, workspace)).as_posix()}]]"


def _said(parent: ET.Element, tag: str, text: str) -> ET.Element:
    element = ET.SubElement(parent, tag)
    element.text = _text(text)
    return element


def _text(text: str) -> str:
    """What a controller wrote on stderr may hold anything."""
    return _NO_XML.sub("�", text)
