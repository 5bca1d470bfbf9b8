"""A release against the one before: what is worse by more than noise rejects, and noise alone does not."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan, pi
from pathlib import Path

import numpy as np
import pytest
from accept_bench import BENCH, BOOT, FAULT, MOVE, SOAK, acceptance_of, with_value

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.results.results_file import Results, read_results, write_results
from drivetwin.hil_tests.results.trend import CaseChange, Change, Kind, Trend, compare
from drivetwin.hil_tests.verdict import CaseResult, Measured, Outcome


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


def stored(folder: Path, *cases: CaseResult) -> Results:
    """The cases as an earlier release's file has them."""
    write_results(acceptance_of(*cases), folder / "results.json")
    return read_results(folder / "results.json")


def trend(folder: Path, before: CaseResult, now: CaseResult) -> Trend:
    return compare(acceptance_of(now), stored(folder, before))


def kind(folder: Path, before: CaseResult, now: CaseResult) -> Kind:
    return trend(folder, before, now).changes[0].kind


def test_the_same_release_has_not_changed(folder: Path) -> None:
    same = compare(acceptance_of(), stored(folder))
    assert {change.kind for change in same.changes} == {Kind.WITHIN_NOISE}
    assert len(same.changes) == 5
    assert same.cases == ()
    assert not same.rejects


@pytest.mark.parametrize(
    ("noise_before", "noise_now", "tolerance"), [(3e-6, 4e-6, 15e-6), (0.0, 5e-6, 15e-6), (None, 5e-6, 15e-6 * 2**0.5)]
)
def test_the_tolerance_is_three_deviations_of_the_difference(
    folder: Path, noise_before: float | None, noise_now: float, tolerance: float
) -> None:
    before = with_value(MOVE, 3e-4, noise_before)
    just_within, beyond = (with_value(MOVE, 3e-4 + share * tolerance, noise_now) for share in (0.99, 1.01))
    assert kind(folder, before, just_within) is Kind.WITHIN_NOISE
    worse = trend(folder, before, beyond)
    assert worse.rejects
    assert worse.changes[0].kind is Kind.REGRESSION
    assert worse.changes[0].tolerance == pytest.approx(tolerance, rel=1e-6)
    assert kind(folder, beyond, before) is Kind.IMPROVEMENT


def test_noise_alone_hardly_ever_rejects(folder: Path) -> None:
    generator = np.random.default_rng(0)
    baseline = stored(folder, *(with_value(replace(MOVE, name=f"n{at}"), 1.0 + generator.normal(), 1.0) for at in range(4000)))
    now = acceptance_of(*(with_value(replace(MOVE, name=f"n{at}"), 1.0 + generator.normal(), 1.0) for at in range(4000)))
    # one-sided tail beyond 3 deviations: 0.135 % of 4000 is 5.4; 18 would be a chance of 1e-5
    assert 0 < len(compare(now, baseline).of(Kind.REGRESSION)) < 18


STEPS = [
    ("rad", "rotate", 2 * pi / 2**20 / 50),  # the encoder's increments, behind a gear of 50 : 1
    ("rad/s", "stretch", 2 * pi / 2**20 / 50 / 0.001),  # one of them in a cycle
    ("N·m", "rotate", 0.0005 * 0.4 * 50),  # the current sensor's step of 0.0005 of rated torque 0.4 N·m
    ("s", None, 0.001),  # the cycle, of which time in lockstep is made
]


@pytest.mark.parametrize(("unit", "axis", "step"), STEPS)
def test_a_quantity_without_noise_may_become_worse_by_what_it_is_resolved_to(
    folder: Path, unit: str, axis: str | None, step: float
) -> None:
    def of(value: float) -> CaseResult:
        return replace(MOVE, measured=(Measured("figure", value, unit, axis, noise=0.0),))

    assert kind(folder, of(0.3 * step), of(1.3 * step)) is Kind.WITHIN_NOISE
    assert kind(folder, of(0.3 * step), of(1.31 * step)) is Kind.REGRESSION
    assert kind(folder, of(0.0), of(1.01 * step)) is Kind.REGRESSION


def test_figures_that_are_shown_alike_are_alike(folder: Path) -> None:
    """Without noise and without a step of its own the last of four digits counts."""
    assert kind(folder, BOOT, with_value(BOOT, 0.42009, 0.0)) is Kind.WITHIN_NOISE
    assert kind(folder, BOOT, with_value(BOOT, 0.42011, 0.0)) is Kind.REGRESSION
    tracking = with_value(MOVE, 1.51354e-3, 0.0)
    assert kind(folder, tracking, with_value(MOVE, 1.5144e-3, 0.0)) is Kind.WITHIN_NOISE
    assert kind(folder, tracking, with_value(MOVE, 1.5147e-3, 0.0)) is Kind.REGRESSION


def test_on_the_wall_clock_a_time_is_as_fine_as_it_was_taken(folder: Path) -> None:
    """SYNC's jitter is a small part of a cycle."""
    bench = BENCH.model_copy(update={"clock": "realtime"})
    before, now = (replace(MOVE, measured=(Measured("SYNC jitter, 99 %", value, "s", noise=0.0),)) for value in (5e-5, 8e-5))
    write_results(Acceptance(bench, (before,), digest=""), folder / "results.json")
    assert compare(Acceptance(bench, (now,), digest=""), read_results(folder / "results.json")).rejects


def test_a_change_whose_noise_nobody_knows_is_told_and_does_not_reject(folder: Path) -> None:
    changed = trend(folder, with_value(BOOT, 0.42, None), with_value(BOOT, 0.6, None))
    assert changed.changes[0].kind is Kind.NOISE_UNKNOWN
    assert not changed.rejects


@pytest.mark.parametrize("never", [inf, nan])
@pytest.mark.parametrize("noise", [1e-3, None])
def test_what_no_longer_comes_about_is_a_regression(folder: Path, never: float, noise: float | None) -> None:
    sound, endless = with_value(FAULT, 0.1, noise), with_value(FAULT, never, noise)
    assert kind(folder, sound, endless) is Kind.REGRESSION
    assert kind(folder, endless, sound) is Kind.IMPROVEMENT
    assert kind(folder, endless, endless) is Kind.WITHIN_NOISE


def test_new_and_gone_quantities_and_changed_cases_are_told(folder: Path) -> None:
    mended = replace(FAULT, outcome=Outcome.ACCEPTED, failures=(), measured=())
    told = compare(acceptance_of(MOVE, mended), stored(folder, BOOT, MOVE, FAULT))
    gone = [Change("08_faults.drive_faults", "time to rest", "rotate", "s", 0.3, None, None, Kind.GONE)]
    assert [change for change in told.of(Kind.GONE) if change.name == "time to rest"] == gone
    assert told.cases == (
        CaseChange("08_faults.drive_faults", Outcome.REJECTED, Outcome.ACCEPTED),
        CaseChange("01_boot.configuration", Outcome.ACCEPTED, None),
    )
    assert [change.name for change in compare(acceptance_of(BOOT, MOVE), stored(folder, MOVE)).of(Kind.NEW)] == ["bus load"]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"machine": "stage"}, "machine scara, this bench has stage"),
        ({"profile": "cia402-full"}, "profile servoone, this bench has cia402-full"),
        ({"clock": "realtime"}, "clock sync, this bench has realtime"),
        ({"truth": Path("worn.json")}, "truth none, this bench has worn.json"),
        ({"limits": {**BENCH.limits, "stop_time": 0.5}}, "limit stop_time 0.2, this bench has 0.5"),
        ({"limits": {**BENCH.limits, "jerk": 3.0}}, "limit jerk none, this bench has 3.0"),
    ],
)
def test_a_baseline_of_another_bench_is_refused_in_one_line(folder: Path, changed: dict[str, object], said: str) -> None:
    baseline = stored(folder, MOVE, SOAK)
    other = Acceptance(Bench.model_validate({**BENCH.model_dump(), **changed}), (MOVE, SOAK), digest="")
    with pytest.raises(UserError) as refused:
        compare(other, baseline)
    assert said in str(refused.value)


def test_another_seed_bus_or_controller_is_compared(folder: Path) -> None:
    command = BENCH.controller.model_copy(update={"name": "next"})
    other = BENCH.model_copy(update={"seed": 7, "bus": "vcan0", "controller": command})
    assert not compare(Acceptance(other, (MOVE,), digest=""), stored(folder, MOVE)).rejects
