"""Scenario files: limits by name, faults and conditions checked before anything runs, errors by file and key."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from stage_bench import bench_file, scenario_file

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.expectations.library import library
from drivetwin.hil_tests.expectations.settling import Settling
from drivetwin.hil_tests.expectations.stopped import Stopped
from drivetwin.hil_tests.scenario import read_scenario
from drivetwin.hil_tests.suite import CASES, find_cases

WITHOUT_TO = {"task": "move", "parameters": {"moves": [{"axis": "slide"}]}}
NOT_ONCE = {"task": "path", "parameters": {"poses": [{"slide": 0.1}], "repeat": 0}}
TOGETHER = {"synchronised": {"apart": 0.1}}
OF_A_WHEEL = {"task": "path", "parameters": {"poses": [{"slide": 0.1}, {"wheel": 1.0}]}}


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return read_bench(bench_file(tmp_path, ["true"]))


@pytest.fixture
def scara() -> Bench:
    return read_bench(Path("hil_tests/benches/scara.yaml"))


def test_limits_are_those_of_the_bench_unless_the_scenario_says_others(tmp_path: Path, bench: Bench) -> None:
    expect = ["settling", {"settling": {"time": 0.7, "band": "homing_error"}}, {"stopped": {"within": 2}}, {"outcome": "done"}]
    of_bench, own, stopped, _ = read_scenario(scenario_file(tmp_path, expect=expect), bench).expectations
    assert of_bench == Settling(time=0.3, band={"slide": 0.0001})
    assert own == Settling(time=0.7, band={"slide": 0.0001})
    assert stopped == Stopped(within=2.0, speed={"slide": 0.002})


def test_a_fault_says_when_and_for_how_long(tmp_path: Path, bench: Bench) -> None:
    when = {"homed": "all", "moving": "slide", "speed": 0.2}
    fault = {"fault": "sto", "node": "slide", "when": when, "after": 0.1, "for": 0.5}
    (planned,) = read_scenario(scenario_file(tmp_path, faults=[fault]), bench).faults
    assert (planned.text, planned.after, planned.lasts) == ("sto node slide", 0.1, 0.5)
    assert (planned.when.moving, planned.when.speed, planned.when.homed) == ("slide", 0.2, "all")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"format": "scenario/9"}, "case.yaml: format: .*'scenario/1'"),
        ({"expext": []}, "case.yaml: expext: is not a known key; there are aftermath, clock, expect"),
        ({"task": {"task": "dance"}}, "case.yaml: task.task: .*'boot'"),
        ({"task": {"task": "move", "parameters": {"x": float("nan")}}}, "case.yaml: task.parameters.x: nan is not a finite"),
        ({"expect": ["heartbeat"]}, "says nothing of how the controller ends"),
        ({"expect": [{"outcome": ["stopped", "done"]}]}, "outcome: there are 2, and starts: 1; say one, or one for each start"),
        ({"expect": [{"outcome": []}]}, "outcome: there are 0, and starts: 1"),
        ({"starts": 3, "expect": [{"outcome": ["stopped", "done"]}]}, "outcome: there are 2, and starts: 3"),
        ({"expect": [{"outcome": "done or finished"}]}, "outcome: 'finished' is not an outcome; there are done, stopped, "),
        ({"task": {"task": "soak"}, "expect": [TOGETHER]}, "expect: synchronised: a task 'soak' has no targets"),
        ({"task": WITHOUT_TO, "expect": ["final_position"]}, "expect: final_position: task: move: nobody can read"),
        ({"task": NOT_ONCE, "expect": [TOGETHER]}, "expect: synchronised: task: path: repeat: expected 1 or more, not 0"),
        ({"task": OF_A_WHEEL, "expect": ["final_position"]}, "expect: final_position: stage has no axis 'wheel', only slide"),
        ({"expect": ["hartbeat"]}, "'hartbeat' is not an expectation; there are .*heartbeat, "),
        ({"expect": [{"outcome": "done", "limits": 1}]}, "expected a name, or one name with what belongs to it"),
        ({"expect": [{"stopped": {"in": 1}}]}, "stopped has no 'in'; it has within, speed"),
        ({"expect": [{"stopped": {"within": "stop_thyme"}}]}, "there is no 'stop_thyme'; this bench has .*stop_time"),
        ({"expect": [{"holds": {}}]}, "holds needs seconds"),
        ({"expect": [{"holds": "long"}]}, "there is no 'long'"),
        ({"expect": [{"tracking_error": {"most": {"wheel": 1}}}]}, "stage has no axis 'wheel', only slide"),
        ({"expect": [{"limits": {"travel": {"slide": 1}}}]}, r"expected \[lowest, highest\] for one of slide"),
        ({"faults": [{"fault": "gremlins", "when": {"time": 0}}]}, "unknown fault 'gremlins'"),
        ({"faults": [{"fault": "sto", "node": 1}]}, "sto: says no `when`; write for example when:"),
        ({"faults": [{"fault": "node_resets", "node": 1, "when": {"time": 0}, "for": 1}]}, "node_resets strikes once"),
        ({"faults": [{"fault": "sto", "node": 7, "when": {"time": 0}}]}, r"stage has no node 7; it has 1 \(slide\)"),
        ({"faults": [{"fault": "sto", "node": 1, "when": {}}]}, "when: expected a mapping like"),
        ({"faults": [{"fault": "sto", "node": 1, "when": {"tame": 0}}]}, "'tame' is not a condition; there are time, sync"),
        ({"faults": [{"fault": "sto", "node": 1, "when": {"time": -1}}]}, "when: time: expected a number from 0 on"),
        ({"faults": [{"fault": "sto", "node": 1, "when": {"moving": "x"}}]}, r"'x' is not an axis .*slide \(node 1\)"),
        ({"faults": [{"fault": "sto", "node": 1, "when": {"state": "on"}}]}, "'on' is not a state .*operation_enabled"),
        ({"faults": [{"fault": "sto", "node": 1, "when": {"time": 1}, "for": "long"}]}, "for: expected seconds"),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, bench: Bench, changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        read_scenario(scenario_file(tmp_path, **changes), bench)


@pytest.mark.parametrize(
    ("when", "expected"),
    [
        ({"speed": 0.5}, "when: speed: belongs to moving; add for example moving: slide"),
        ({"node": 1, "speed": 0.5}, "when: speed: belongs to moving; add for example moving: slide"),
        ({"axis": "slide"}, "when: axis: belongs to state; add for example state: operation_enabled"),
        ({"node": 1, "time": 1.0}, "when: node: belongs to state; add for example state: operation_enabled"),
        ({"state": "fault", "axis": "slide", "node": 1}, "when: axis and node both name a drive; leave one out"),
        ({"moving": None}, "when: moving: says nothing"),
        ({"homed": ["slide"]}, r"when: homed: \['slide'\] is not an axis .*slide \(node 1\)"),
        ({"moving": ["slide"]}, r"when: moving: \['slide'\] is not an axis"),
        ({"moving": True}, "when: moving: True is not an axis"),
        ({"state": ["fault"]}, r"when: state: \['fault'\] is not a state"),
        ({"state": "fault", "node": {"slide": 1}}, r"when: node: \{'slide': 1\} is not an axis"),
    ],
)
def test_a_condition_says_all_that_it_is_about(
    tmp_path: Path, bench: Bench, when: dict[str, Any], expected: str
) -> None:
    with pytest.raises(UserError, match=expected):
        read_scenario(scenario_file(tmp_path, faults=[{"fault": "sto", "node": 1, "when": when}]), bench)


def test_a_case_stands_in_a_numbered_group(tmp_path: Path, bench: Bench) -> None:
    with pytest.raises(UserError, match=r"a case stands in a folder NN_group, for example 04_moves/case.yaml"):
        read_scenario(scenario_file(tmp_path, "moves/case"), bench)


def test_every_expectation_of_the_library_is_used_by_a_case_of_the_product(scara: Bench) -> None:
    used = {expectation.name for case in find_cases(scara, [CASES], []) for expectation in case.expectations}
    assert used == set(library())


def test_the_products_cases_come_in_the_order_in_which_a_machine_comes_alive(scara: Bench) -> None:
    numbers = [case.number for case in find_cases(scara, [CASES], [])]
    assert numbers == sorted(numbers)
    assert set(numbers) == set(range(1, 12))


def test_cases_about_another_machine_are_read_and_skipped(tmp_path: Path, bench: Bench) -> None:
    case = read_scenario(scenario_file(tmp_path, machine="scara"), bench)
    assert case.skipped_because == "the case is about machine scara, and this bench has stage"
    assert case.expectations == ()


def test_cases_are_chosen_by_number_group_and_name(scara: Bench) -> None:
    assert {case.group for case in find_cases(scara, [CASES], ["4"])} == {"moves"}
    assert [case.name for case in find_cases(scara, [CASES], ["*.single", "08_faults.drive_f*"])] == ["single", "drive_fault"]
    with pytest.raises(UserError, match="--select 99 names no case; there are groups 01_boot, 02_enable"):
        find_cases(scara, [CASES], ["99"])


def test_own_cases_stand_beside_the_products_and_no_name_is_there_twice(tmp_path: Path, scara: Bench) -> None:
    scenario_file(tmp_path, "04_moves/own")
    assert "04_moves.own" in [case.identity for case in find_cases(scara, [CASES, tmp_path], ["4"])]
    scenario_file(tmp_path, "04_moves/single")
    with pytest.raises(UserError, match=r"there is a case 04_moves.single already"):
        find_cases(scara, [CASES, tmp_path], [])
    with pytest.raises(UserError, match=r"has no cases; expected files NN_group/name.yaml"):
        find_cases(scara, [tmp_path / "04_moves"], [])
