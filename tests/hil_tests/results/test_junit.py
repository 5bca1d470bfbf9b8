"""junit.xml against the schema's rules written out here, and as GitLab, Jenkins and GitHub's reporters read it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

from accept_bench import BOOT, FAULT, MOVE, SOAK, acceptance_of, with_value

from drivetwin.hil_tests.results.junit import write_junit
from drivetwin.hil_tests.results.results_file import read_results, write_results
from drivetwin.hil_tests.results.trend import compare

# junit-10.xsd of Jenkins' xUnit plugin: attributes that must be there, that may be there, and children.
SCHEMA = {
    "testsuites": ((), ("name", "time", "tests", "failures", "errors"), ("testsuite",)),
    "testsuite": (("name", "tests", "failures", "errors"), ("time", "skipped"), ("properties", "testcase")),
    "properties": ((), (), ("property",)),
    "property": (("name", "value"), (), ()),
    "testcase": (("name",), ("time", "classname"), ("skipped", "failure", "system-out")),
    "failure": ((), ("type", "message"), ()),
    "skipped": ((), ("type", "message"), ()),
    "system-out": ((), (), ()),
}
SUREFIRE_TIME = re.compile(r"(([0-9]{0,3},)*[0-9]{3}|[0-9]{0,3})*(\.[0-9]{0,3})?")
# GitLab, lib/gitlab/ci/parsers/test/junit.rb; Jenkins' junit-attachments wants each on a line of its own.
ATTACHMENT = re.compile(r"^\[\[ATTACHMENT\|([^\[\]|]+?)\]\]$", re.MULTILINE)


def written(folder: Path, *cases: object) -> ET.Element:
    write_junit(acceptance_of(*cases), folder / "junit.xml", folder)  # type: ignore[arg-type]
    return ET.parse(folder / "junit.xml").getroot()


def test_every_element_is_one_of_the_schema(tmp_path: Path) -> None:
    root = written(tmp_path)
    assert root.tag == "testsuites"
    for element in root.iter():
        required, optional, children = SCHEMA[element.tag]
        assert set(required) <= set(element.attrib) <= {*required, *optional}
        assert {child.tag for child in element} <= set(children)
        assert SUREFIRE_TIME.fullmatch(element.get("time", "0"))


def test_counts_and_simulated_times_add_up(tmp_path: Path) -> None:
    root = written(tmp_path)
    assert [suite.get("name") for suite in root] == ["01_boot", "04_moves", "07_feed_forward", "08_faults", "11_soak"]
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("5", "1", "0")
    assert [suite.get("skipped") for suite in root] == ["0", "0", "0", "0", "1"]
    times = [float(case.get("time", "")) for case in root.iter("testcase")]
    assert times == [0.25, 6.125, 9.0, 2.5, 0.0]
    assert float(root.get("time", "")) == sum(times)


def test_a_failure_says_requirement_when_axis_and_measured_against_limit(tmp_path: Path) -> None:
    (failure,) = written(tmp_path).iter("failure")
    first = "stopped: still moves <0.3 s> after the fault (rotate, at 1.062 s, 0.3 s, limit 0.2 s)"
    assert failure.get("message") == f"{first} (and 1 more)"
    text = failure.text or ""
    assert "Requirement: Every axis is at rest within stop_time of the fault." in text
    assert first in text
    assert "the controller went on as if nothing had happened" in text


def test_what_xml_cannot_hold_is_replaced(tmp_path: Path) -> None:
    (failure,) = written(tmp_path, replace(FAULT, failures=FAULT.failures[1:])).iter("failure")
    assert "�[31mpanic�" in (failure.text or "")


def test_why_a_case_was_skipped_stands_in_text_and_message(tmp_path: Path) -> None:
    (skipped,) = written(tmp_path, SOAK).iter("skipped")
    assert skipped.text == skipped.get("message") == "the controller has no task soak"


def test_files_that_are_there_are_attached_relative_to_the_workspace(tmp_path: Path) -> None:
    folder = tmp_path / "out" / "cases" / "08_faults.drive_faults"
    folder.mkdir(parents=True)
    (folder / "controller.log").touch()
    (folder / "bus.log").touch()
    write_junit(acceptance_of(replace(FAULT, folder=folder)), tmp_path / "out" / "junit.xml", tmp_path)
    out = ET.parse(tmp_path / "out" / "junit.xml").getroot().findtext("testsuite/testcase/system-out") or ""
    named = "out/cases/08_faults.drive_faults"
    assert ATTACHMENT.findall(out) == [f"{named}/bus.log", f"{named}/controller.log"]
    assert "time to rest, rotate: 0.3 s, limit 0.2 s" in out


def test_what_has_become_worse_fails_a_case_of_its_own(tmp_path: Path) -> None:
    write_results(acceptance_of(MOVE), tmp_path / "results.json")
    baseline = read_results(tmp_path / "results.json")
    for value, failures in ((3.1e-4, 0), (4.1e-4, 1)):
        now = acceptance_of(with_value(MOVE, value, 1e-6))
        write_junit(now, tmp_path / "junit.xml", tmp_path, compare(now, baseline))
        root = ET.parse(tmp_path / "junit.xml").getroot()
        assert (root.get("tests"), root.get("failures")) == ("2", str(failures))
    (failure,) = root.iter("failure")
    said = "04_moves.single, tracking error, lift: 0.31 mm, now 0.41 mm, tolerance 4.243 µm"
    assert failure.get("message") == said
    assert "Worse than reference & <co> by more than noise" in (failure.text or "")


def test_two_runs_that_differ_in_wall_time_only_write_the_same_bytes(tmp_path: Path) -> None:
    for name, wall in (("a", 1.0), ("b", 2.0)):
        write_junit(acceptance_of(replace(BOOT, wall=wall), replace(MOVE, wall=wall)), tmp_path / name, tmp_path)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
