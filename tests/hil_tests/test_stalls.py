"""A stand that stood still itself runs a case again that it rejected in real time, and says so; not so in lockstep."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_evidence import evidence, standing
from stage_bench import bad, bench_file, scenario_file

from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.evidence import Stall
from drivetwin.hil_tests.judge import judge
from drivetwin.hil_tests.results.wording import caveats
from drivetwin.hil_tests.run import STANDS, run_one
from drivetwin.hil_tests.scenario import Scenario, read_scenario
from drivetwin.hil_tests.stand.observer import Observer
from drivetwin.hil_tests.stand.stalls import Stalls
from drivetwin.hil_tests.verdict import CaseResult, Outcome

STALL = 0.08
"""How long the stand is made to stand still [s]; a busy host only adds to it."""


def test_a_turn_that_takes_longer_than_a_drive_may_is_a_stall() -> None:
    walls = iter([0.0, 5.0, 5.0005, 5.0204, 5.1, 9.0, 9.0199])
    stalls = Stalls(lambda: 1.5, lambda: next(walls))
    stalls.begin()  # at 5 s
    for _ in range(3):
        stalls.look()
    stalls.begin()  # at 9 s
    stalls.look()
    assert [tuple(stall) for stall in stalls.found] == [pytest.approx((1.5, 0.0796))]


@pytest.mark.parametrize(("long", "late"), [([0.0035, 0.003, 0.0025, 0.002], 0.0025), ([0.0035, 0.003], 0.0), ([], 0.0)])
def test_how_late_a_hundredth_of_the_time_is(long: list[float], late: float) -> None:
    """Of 0.8 s in turns of half a millisecond, and a few that last longer."""
    walls = np.concatenate([[0.0, 0.0], np.cumsum([0.0005] * 1600 + long)]).tolist()
    stalls = Stalls(lambda: 0.0, iter(walls).__next__)
    stalls.begin()
    for _ in range(1600 + len(long)):
        stalls.look()
    assert stalls.late == pytest.approx(late)
    assert stalls.found == []


def test_a_host_that_is_late_all_along_is_told_by_the_cycle(tmp_path: Path) -> None:
    def failures(late: float) -> list[str]:
        told = judge(scenario(tmp_path, "stopped"), evidence(standing(2.0), late=late), tmp_path, 0.0).failures
        return [one.expectation for one in told]

    cycle = evidence(standing(2.0)).bench.cycle
    assert failures(1.1 * cycle) == ["outcome", "host"]
    assert failures(0.9 * cycle) == ["outcome"]


def scenario(folder: Path, outcome: str) -> Scenario:
    return read_scenario(scenario_file(folder, expect=[{"outcome": outcome}]), read_bench(bench_file(folder, bad("crashes"))))


def test_it_stands_beside_what_failed_with_the_longest(tmp_path: Path) -> None:
    of = evidence(standing(2.0), stalls=(Stall(0.5, 0.021), Stall(1.2, 0.066), Stall(1.4, 0.03)))
    result = judge(scenario(tmp_path, "stopped"), of, tmp_path, 0.0)
    assert result.outcome is Outcome.REJECTED
    assert [one.expectation for one in result.failures] == ["outcome", "host"]
    host = result.failures[-1]
    assert (host.time, host.measured, host.limit, host.unit) == (1.2, 0.066, 0.02, "s")
    assert "for 66 ms the longest of 3 times" in host.message


def test_a_case_that_is_met_says_nothing_of_it(tmp_path: Path) -> None:
    of = evidence(standing(2.0), stalls=(Stall(0.5, 0.066),))
    assert judge(scenario(tmp_path, "done"), of, tmp_path, 0.0).outcome is Outcome.ACCEPTED


@pytest.mark.parametrize(("clock", "tries", "told"), [("realtime", 3, True), ("sync", 1, False)])
def test_the_stand_notices_in_real_time_and_tries_three_times_and_in_lockstep_there_is_no_stall(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, clock: str, tries: int, told: bool
) -> None:
    look, slow = Observer.look, []

    def slowly_once_a_run(observer: Observer) -> None:
        if observer not in slow:
            slow.append(observer)
            time.sleep(STALL)
        look(observer)

    monkeypatch.setattr(Observer, "look", slowly_once_a_run)
    result = crashed(tmp_path, clock)
    lasted = [one.measured for one in result.failures if one.expectation == "host"]
    assert result.outcome is Outcome.REJECTED
    assert result.tries == len(slow) == tries
    assert bool(lasted) is told
    assert all(one is not None and one >= STALL for one in lasted)


def crashed(folder: Path, clock: str) -> CaseResult:
    bench = read_bench(bench_file(folder, bad("crashes"), clock=clock))
    return run_one(bench, read_scenario(scenario_file(folder), bench), folder / "out")


@pytest.mark.parametrize(("outcome", "tries"), [("stopped", 2), ("done", 1)])
def test_the_last_run_counts_and_one_that_was_met_is_the_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outcome: str, tries: int
) -> None:
    left = [evidence(standing(2.0), stalls=(Stall(0.5, 0.066),)), evidence(standing(2.0))]
    monkeypatch.setitem(STANDS, "virtual", lambda *_: left.pop(0))
    asked = scenario(tmp_path, outcome)
    result = run_one(read_bench(tmp_path / "bench.yaml"), asked, tmp_path / "out")
    assert result.tries == tries
    assert "host" not in [one.expectation for one in result.failures]


def test_a_case_that_was_run_again_says_so(tmp_path: Path) -> None:
    met = judge(scenario(tmp_path, "done"), evidence(standing(2.0)), tmp_path, 0.0)
    assert caveats(met) == ()
    assert caveats(replace(met, tries=2)) == ("run twice: before, the stand stood still itself where it was rejected",)
