"""Runs the cases of a suite, several at a time, each in a process of its own, and judges them."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from drivetwin.emulator.effects import add_effects, added_effects
from drivetwin.foundation.arithmetic import children_compute_alike
from drivetwin.foundation.children import tied_processes
from drivetwin.foundation.collector import without_collector
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import told_of
from drivetwin.hil_tests.bench import EMBEDDED, Bench
from drivetwin.hil_tests.folder import write_case
from drivetwin.hil_tests.judge import judge, not_run, skipped
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.stand.real_stand import run_real_case
from drivetwin.hil_tests.stand.stalls import HOST
from drivetwin.hil_tests.stand.stand import run_case
from drivetwin.hil_tests.verdict import CaseResult, Outcome

STANDS = {"virtual": run_case, "real": run_real_case}
"""By what the bench's drives are."""


TRIES = 3
"""Most runs of one case in real time, each but the last spoilt by the stand itself."""


def run_one(bench: Bench, scenario: Scenario, folder: Path) -> CaseResult:
    """Run and judge one case; `folder` is made anew and gets all that the case leaves.

    In real time a rejection says little where the stand stood still itself: the case is run again then, `TRIES` times at most,
    and the last run is what counts. Raises UserError where the bus cannot be had or the controller's command not be started.
    """
    if scenario.skipped_because is not None:
        return skipped(scenario, scenario.skipped_because)
    tries = 1
    result = _run_once(bench, scenario, folder)
    while tries < TRIES and any(failure.expectation == HOST for failure in result.failures):
        tries += 1
        result = _run_once(bench, scenario, folder)
    return replace(result, tries=tries)


def _run_once(bench: Bench, scenario: Scenario, folder: Path) -> CaseResult:
    shutil.rmtree(folder, ignore_errors=True)
    began = time.monotonic()
    with told_of(folder):
        folder.mkdir(parents=True)
        with without_collector():  # what is noted grows to hundreds of thousands of objects
            evidence = STANDS[bench.drives](bench, scenario, folder)
        result = judge(scenario, evidence, folder, time.monotonic() - began)
        write_case(result, evidence, folder)
    return result


def run_all(
    bench: Bench, scenarios: Sequence[Scenario], cases: Path, jobs: int, done: Callable[[CaseResult], None]
) -> list[CaseResult]:
    """Run and judge every case in `cases`/NN_group.name; the verdicts in the order of the scenarios.

    `done` hears of each as it comes. On the wall clock and with real drives they run one by one, with real drives only as long
    as none is rejected. Else they run in processes that compute as on any other host: at once, but one by one on a bus that all
    cases share.
    """
    jobs = jobs if bench.bus == EMBEDDED else 1
    places = [cases / scenario.identity for scenario in scenarios]
    results: dict[str, CaseResult] = {}
    for result in _at_once(bench, scenarios, places, jobs) if _in_lockstep(bench) else _one_by_one(bench, scenarios, places):
        results[f"{result.number:02d}_{result.group}.{result.name}"] = result
        done(result)
    return [results[scenario.identity] for scenario in scenarios]


def _in_lockstep(bench: Bench) -> bool:
    """Whether what is computed is all that counts: nobody sees how long it takes, nor where."""
    return bench.drives == "virtual" and bench.clock == "sync"


def _one_by_one(bench: Bench, scenarios: Sequence[Scenario], places: Sequence[Path]) -> Iterator[CaseResult]:
    """In their order; real drives go no further once the controller was rejected: what comes next builds on it.

    Raises UserError as `run_one`; once a case has run on real drives, what then cannot be run is rejected and the rest kept.
    """
    rejected, has_run = None, False
    for scenario, place in zip(scenarios, places, strict=True):
        if rejected is not None and bench.drives == "real" and scenario.skipped_because is None:
            yield skipped(scenario, f"{rejected} was rejected, and drives are real: nothing more is run")
            continue
        try:
            result = run_one(bench, scenario, place)
        except UserError as error:
            if bench.drives != "real" or not has_run:
                raise
            result = not_run(scenario, str(error))
        has_run = has_run or result.outcome is not Outcome.SKIPPED
        if result.outcome is Outcome.REJECTED:
            rejected = rejected or scenario.identity
        yield result


class CaseProcesses:
    """Processes for cases in lockstep, which compute as on any other host; the first begins with the first case."""

    def __init__(self, number: int) -> None:
        self._number = number

    @cached_property
    def _pool(self) -> ProcessPoolExecutor:
        """With the effects that have been added by now."""
        return ProcessPoolExecutor(self._number, tied_processes(), add_effects, (added_effects(),))

    def submit(self, bench: Bench, scenario: Scenario, folder: Path) -> Future[CaseResult]:
        """`run_one` in one of them."""
        with children_compute_alike():
            return self._pool.submit(run_one, bench, scenario, folder)

    def run(self, bench: Bench, scenario: Scenario, folder: Path) -> CaseResult:
        """`run_one`: in lockstep in one of them, else in this process. Raises UserError also where that process is killed."""
        if not _in_lockstep(bench):
            return run_one(bench, scenario, folder)
        try:
            return self.submit(bench, scenario, folder).result()
        except BrokenProcessPool:
            raise UserError(f"{KILLED}?") from None

    def end(self) -> None:
        """Begin no further case, and wait for those that run."""
        if "_pool" in vars(self):
            self._pool.shutdown(wait=True, cancel_futures=True)


KILLED = "a process that ran a case was killed: is there enough memory"


def _at_once(bench: Bench, scenarios: Sequence[Scenario], places: Sequence[Path], jobs: int) -> Iterator[CaseResult]:
    processes = CaseProcesses(jobs)
    try:
        # what comes late in a machine's life lasts longest, and is not left for the end
        runs = reversed(list(zip(scenarios, places, strict=True)))
        tasks = [processes.submit(bench, scenario, place) for scenario, place in runs]
        for task in as_completed(tasks):
            yield task.result()
    except BrokenProcessPool:
        fewer = "; --jobs 1 needs the least" if jobs > 1 else ""
        raise UserError(f"{KILLED}{fewer}?") from None
    finally:
        processes.end()
