"""A case's evidence to its verdict: asks every expectation, including those that every scenario implies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Finding
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.stand.stalls import HOST, LONGEST
from drivetwin.hil_tests.verdict import CaseResult, Failure, Measured, Outcome


def judge(scenario: Scenario, evidence: Evidence, folder: Path, wall: float) -> CaseResult:
    """The verdict; `folder` is the case's own, `wall` how long it took [s]."""
    finding = sum((expectation.judge(evidence) for expectation in scenario.expectations), MET)
    finding += Finding(tuple(_always(evidence)))
    if finding.failures:
        finding += Finding(tuple(_by_the_host(evidence)))
    measured = tuple(_with_noise(one, evidence.bench) for one in finding.measured)
    outcome = Outcome.REJECTED if finding.failures else Outcome.ACCEPTED
    simulated = float(evidence.truth.time[-1]) if len(evidence.truth.time) else evidence.end
    return _result(scenario, outcome, finding.failures, measured, "", simulated, wall, folder)


def skipped(scenario: Scenario, because: str) -> CaseResult:
    """The verdict of a case that was not run."""
    return _result(scenario, Outcome.SKIPPED, (), (), because, 0.0, 0.0, None)


def not_run(scenario: Scenario, because: str) -> CaseResult:
    """The verdict of a case that others were run before, and that could not be run itself."""
    failure = Failure("bus", f"it was not run: {because}")
    return _result(scenario, Outcome.REJECTED, (failure,), (), "", 0.0, 0.0, None)


def _always(evidence: Evidence) -> list[Failure]:
    """Every fault struck, the controller left nothing behind, and all was heard."""
    never = [
        Failure("fault", f"{struck.text} never struck: what it waits for never came", time=evidence.end)
        for struck in evidence.struck
        if struck.time is None
    ]
    left = [Failure("leaves nothing", f"the controller left behind, at {what}") for what in evidence.left_behind]
    lost = evidence.bus_lost
    return never + left + ([] if lost is None else [Failure("bus", f"the bus was lost: {lost.reason}", time=lost.time)])


def _by_the_host(evidence: Evidence) -> list[Failure]:
    """Where the stand stood still itself, a sound controller may have been rejected for it. It is not accepted for it."""
    so = "what failed may be of this host and not of the controller; run it where nothing else is done, or in lockstep"
    if evidence.stalls:
        worst = max(evidence.stalls, key=lambda stall: stall.seconds)
        times = len(evidence.stalls)
        told = f"the stand stood still itself, for {1e3 * worst.seconds:.0f} ms the longest of {times} times: {so}"
        return [Failure(HOST, told, time=worst.time, measured=worst.seconds, limit=LONGEST, unit="s")]
    cycle = evidence.bench.cycle
    if evidence.late > cycle:
        told = f"the stand was late itself, one per cent of the time by more than a cycle: {so}"
        return [Failure(HOST, told, measured=evidence.late, limit=cycle, unit="s")]
    return []


def _with_noise(measured: Measured, bench: Bench) -> Measured:
    """With the noise that the bench knows of this quantity."""
    known = bench.noise.get(measured.name)
    if isinstance(known, dict):
        known = known.get(measured.axis or "")
    return measured if known is None else replace(measured, noise=known)


def _result(
    scenario: Scenario,
    outcome: Outcome,
    failures: Sequence[Failure],
    measured: Sequence[Measured],
    because: str,
    simulated: float,
    wall: float,
    folder: Path | None,
) -> CaseResult:
    return CaseResult(
        number=scenario.number,
        group=scenario.group,
        name=scenario.name,
        title=scenario.title,
        requirement=" ".join(scenario.requirement.split()),
        outcome=outcome,
        failures=tuple(failures),
        measured=tuple(_worst_of_each(measured)),
        skipped_because=because,
        simulated=simulated,
        wall=wall,
        folder=folder,
        not_judged=scenario.not_judged,
    )


def _worst_of_each(measured: Sequence[Measured]) -> list[Measured]:
    """One entry a quantity and axis: where one was measured several times, the greatest."""
    worst: dict[tuple[str, str | None], Measured] = {}
    for one in measured:
        known = worst.get((one.name, one.axis))
        if known is None or one.value > known.value:
            worst[one.name, one.axis] = one
    return list(worst.values())
