"""Cases in shares: on any machine names and numbers of its own, and who is accepted where cases were skipped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from stage_bench import LIMITS, bench_file, scenario_file

from drivetwin.emulator.faults.frames_late import FramesLate
from drivetwin.emulator.faults.friction_rise import FrictionRise
from drivetwin.emulator.faults.node_changes_id import NodeChangesId
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.expectations.limits import Limits
from drivetwin.hil_tests.expectations.names_fault import NamesFault
from drivetwin.hil_tests.expectations.stopped import Stopped
from drivetwin.hil_tests.judge import skipped
from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.results.wording import verdict_sentence
from drivetwin.hil_tests.scenario import read_scenario
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.hil_tests.verdict import CaseResult, Outcome

SCARA = Path("hil_tests/benches/scara.yaml")
"""Travels [0, 0.345], [-2.85, 2.85], [0.11, 1.39]; speeds 0.28, 2.8, 2.3; torques 1500, 40, 40; nodes 1 to 3."""
EVERY_LIMIT = {**LIMITS, "apart": 0.01, "identification_error": 0.03, "feed_forward_ratio": 0.8, "payload": 1.0}


@pytest.fixture
def scara() -> Bench:
    return read_bench(SCARA)


@pytest.fixture
def stage(tmp_path: Path) -> Bench:
    return read_bench(bench_file(tmp_path, ["true"], limits=EVERY_LIMIT))


def parameters(folder: Path, bench: Bench, task: str, told: dict[str, Any]) -> dict[str, Any]:
    return read_scenario(scenario_file(folder, task={"task": task, "parameters": told}), bench).task.parameters


def test_moves_are_shares_of_the_way_between_the_ends_of_the_travel(tmp_path: Path, scara: Bench) -> None:
    moves = [{"axis": "each", "to": ["50 %", "100%"]}, {"axis": "last", "to": 0.2}]
    told = parameters(tmp_path, scara, "move", {"moves": moves})
    assert [move["axis"] for move in told["moves"]] == ["lift", "lift", "rotate", "rotate", "stretch", "stretch", "stretch"]
    assert [move["to"] for move in told["moves"]] == pytest.approx([0.1725, 0.345, 0.0, 2.85, 0.75, 1.39, 0.2])


def test_what_is_said_of_one_axis_counts_more_than_what_is_said_of_each(tmp_path: Path, scara: Bench) -> None:
    told = parameters(tmp_path, scara, "path", {"poses": [{"middle": "50 %", "each": "0 %"}]})
    assert told["poses"] == [pytest.approx({"lift": 0.0, "rotate": 0.0, "stretch": 0.11})]


def test_a_machine_of_one_axis_has_it_in_all_places(tmp_path: Path, stage: Bench) -> None:
    told = parameters(tmp_path, stage, "path", {"poses": [{"first": 0.1}, {"each": "25 %", "last": "75 %"}]})
    assert told["poses"] == [{"slide": 0.1}, {"slide": 0.5}]


def test_a_fault_is_in_numbers_of_its_machine(tmp_path: Path, scara: Bench) -> None:
    when = {"homed": "all", "moving": "last", "speed": "50 %"}
    given = [
        {"fault": "friction_rise", "node": "middle", "torque": "150 %", "over": 1.0, "when": when},
        {"fault": "frames_late", "node": "last", "direction": "received", "cob_id": "rpdo 2", "delay": 0.1, "when": when},
        {"fault": "node_changes_id", "node": "first", "new_id": "free", "when": when},
    ]
    rise, late, stranger = read_scenario(scenario_file(tmp_path, faults=given), scara).faults
    assert isinstance(rise.fault, FrictionRise)
    assert (rise.fault.node, rise.fault.torque) == ("rotate", 60.0)
    assert (rise.when.moving, rise.when.speed) == ("stretch", 1.15)
    assert isinstance(late.fault, FramesLate)
    assert late.fault.cob_id == 0x303
    assert isinstance(stranger.fault, NodeChangesId)
    assert stranger.fault.new_id == 4


def test_an_expectation_takes_shares_of_the_limit_that_it_stands_for(tmp_path: Path, scara: Bench) -> None:
    expect = [
        {"outcome": "stopped"},
        {"names_fault": "last"},
        {"limits": {"torque": {"each": "100 %", "middle": "155 %"}, "speed": "50 %"}},
        {"stopped": {"except_for": ["middle"]}},
    ]
    _outcome, names, limits, stopped = read_scenario(scenario_file(tmp_path, expect=expect), scara).expectations
    assert names == NamesFault(3)
    assert isinstance(limits, Limits)
    assert limits.torque == pytest.approx({"lift": 1500.0, "rotate": 62.0, "stretch": 40.0})
    assert limits.speed == pytest.approx({"lift": 0.14, "rotate": 1.4, "stretch": 1.15})
    assert isinstance(stopped, Stopped)
    assert stopped.except_for == ("rotate",)


def test_as_many_cases_run_on_a_stage_as_on_the_scara(stage: Bench, scara: Bench) -> None:
    tasks = {"controller": scara.controller}
    on_stage, on_scara = (find_cases(bench.model_copy(update=tasks), [CASES], ()) for bench in (stage, scara))
    ran = [[case.identity for case in cases if case.skipped_because is None] for cases in (on_stage, on_scara)]
    assert ran[0] == ran[1]
    assert len(ran[0]) == len(on_scara) - 1  # the one of the wall clock


def test_a_case_about_a_load_is_skipped_where_the_bench_names_none(stage: Bench) -> None:
    without = stage.model_copy(update={"limits": {key: limit for key, limit in stage.limits.items() if key != "payload"}})
    (case,) = find_cases(without, [CASES], ["08_faults.payload"])
    assert case.skipped_because == "the bench does not say what load its machine carries (limits.payload in bench.yaml)"


def test_a_share_of_what_the_bench_does_not_say_is_refused(tmp_path: Path, stage: Bench) -> None:
    bench = stage.model_copy(update={"limits": {}})
    with pytest.raises(UserError, match="there is no 'travel'"):
        parameters(tmp_path, bench, "path", {"poses": [{"first": "10 %"}]})


def test_a_machine_of_ones_own_stands_beside_the_bench(tmp_path: Path) -> None:
    bench = read_bench(bench_file(tmp_path, ["true"]))
    assert bench.machine_place == "stage"
    (tmp_path / "mine").mkdir()
    assert bench.model_copy(update={"machine": "mine"}).machine_place == str((tmp_path / "mine").resolve())


def results(bench: Bench, outcomes: dict[str, Outcome]) -> tuple[CaseResult, ...]:
    cases = {case.identity: case for case in find_cases(bench, [CASES], tuple(outcomes))}
    return tuple(replace(skipped(cases[name], ""), outcome=outcome) for name, outcome in outcomes.items())


@pytest.mark.parametrize(
    ("needs", "accepted", "said"),
    [
        ([], True, "Accepted: all of 1 cases passed, 2 skipped (1 of 04_moves, all of 05_paths)."),
        (["moves", "faults"], True, "Accepted: all of 1 cases passed, 2 skipped (1 of 04_moves, all of 05_paths)."),
        (
            ["moves", "paths"],
            False,
            "Not accepted: the bench needs paths, of which no case was judged; 1 others passed, 2 skipped (1 of 04_moves, "
            "all of 05_paths).",
        ),
    ],
)
def test_accepted_needs_the_groups_that_the_bench_names(scara: Bench, needs: list[str], accepted: bool, said: str) -> None:
    bench = scara.model_copy(update={"needs": needs})
    outcomes = {"04_moves.single": Outcome.ACCEPTED, "04_moves.small": Outcome.SKIPPED, "05_paths.square": Outcome.SKIPPED}
    acceptance = Acceptance(bench, results(bench, outcomes), "")
    assert acceptance.accepted is accepted
    assert verdict_sentence(acceptance) == said
