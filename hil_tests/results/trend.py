"""What changed since an earlier acceptance, and which changes exceed noise and resolution for the worse."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import hypot, inf, isfinite
from typing import NamedTuple

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.results.resolution import resolution
from drivetwin.hil_tests.results.results_file import CasePart, MeasuredPart, Results, bench_part
from drivetwin.hil_tests.results.wording import case_name, quantity, quantity_name
from drivetwin.hil_tests.verdict import CaseResult, Measured, Outcome

TIMES_NOISE = 3.0
"""How many standard deviations of a difference count as a change: one in 740 happens without a cause, for normal noise."""

_ROUNDING = 1e-9
"""Of two numbers that differ by a step, in shares of it."""
_MUST_AGREE = ("machine", "profile", "truth", "clock", "bit_rate", "bit_timing", "cycle", "drives")


class Kind(StrEnum):
    """What a change of a quantity is."""

    REGRESSION = "regression"
    IMPROVEMENT = "improvement"
    WITHIN_NOISE = "within noise"
    NOISE_UNKNOWN = "noise not known"
    NEW = "new"
    GONE = "gone"


@dataclass(frozen=True)
class Change:
    """One quantity then and now [unit]; infinite where it never came about, None where it was not measured.

    `tolerance` [unit] is what it may change by without having changed, None where its noise is not known.
    """

    case: str
    name: str
    axis: str | None
    unit: str
    before: float | None
    now: float | None
    tolerance: float | None
    kind: Kind

    @property
    def words(self) -> str:
        """`04_moves.single, tracking error, lift: 0.31 mm, now 0.4 mm, tolerance 6 µm`."""
        said = [f"{label}{quantity(value, self.unit)}" for label, value in self._figures if value is not None]
        return f"{self.case}, {quantity_name(self.name, self.axis)}: {', '.join(said)}"

    @property
    def _figures(self) -> tuple[tuple[str, float | None], ...]:
        return ("", self.before), ("now ", self.now), ("tolerance ", self.tolerance)


@dataclass(frozen=True)
class CaseChange:
    """A case whose outcome is another than before; None: it was not among the cases."""

    case: str
    before: Outcome | None
    now: Outcome | None


@dataclass(frozen=True)
class Trend:
    """All quantities and changed cases since the acceptance of `controller` under `version`, in the order of the cases."""

    controller: str
    version: str
    changes: tuple[Change, ...]
    cases: tuple[CaseChange, ...]

    def of(self, kind: Kind) -> tuple[Change, ...]:
        """The changes of one kind."""
        return tuple(change for change in self.changes if change.kind is kind)

    @property
    def rejects(self) -> bool:
        """Whether a quantity has become worse by more than its tolerance."""
        return bool(self.of(Kind.REGRESSION))


class _Key(NamedTuple):
    case: str
    name: str
    axis: str | None
    unit: str


def compare(acceptance: Acceptance, baseline: Results) -> Trend:
    """Hold an acceptance against an earlier one.

    A quantity has changed where it differs by more than 3 standard deviations of the difference, sqrt(noise_before² +
    noise_now²) each, and by more than its `resolution`: what noise does not reach is still no finer than that. Raises UserError
    where the two are of different machines, drive types, clocks, wires, cycles or limits.
    """
    check_baseline(acceptance.bench, baseline)
    before, now = _quantities(baseline.cases), _quantities(acceptance.cases)
    changes = [_change(acceptance.bench, key, before.get(key), now.get(key)) for key in dict.fromkeys((*now, *before))]
    cases = _changed_cases(_outcomes(baseline.cases), _outcomes(acceptance.cases))
    return Trend(baseline.bench.controller, baseline.version, tuple(changes), cases)


def check_baseline(bench: Bench, baseline: Results) -> None:
    """Raise UserError where figures of this bench cannot be held against the baseline's; ask before long work."""
    now, before = bench_part(bench), baseline.bench
    for name in _MUST_AGREE:
        _refuse(name.replace("_", " "), getattr(before, name), getattr(now, name))
    for name in dict.fromkeys((*now.limits, *before.limits)):
        _refuse(f"limit {name}", before.limits.get(name), now.limits.get(name))


def _refuse(what: str, before: object, now: object) -> None:
    if before != now:
        raise UserError(
            f"the baseline was made with {what} {_said(before)}, this bench has {_said(now)}: figures cannot be compared; "
            "give a results.json of this bench, or none and keep what is written now"
        )


def _said(value: object) -> str:
    return "none" if value is None else str(value)


def _quantities(cases: Iterable[CaseResult | CasePart]) -> dict[_Key, Measured | MeasuredPart]:
    return {
        _Key(case_name(case), measured.name, measured.axis, measured.unit): measured
        for case in cases
        for measured in case.measured
    }


def _change(bench: Bench, key: _Key, before: Measured | MeasuredPart | None, now: Measured | MeasuredPart | None) -> Change:
    values = [None if measured is None else _value(measured) for measured in (before, now)]
    tolerance = None
    if before is None or now is None:
        kind = Kind.NEW if before is None else Kind.GONE
    else:
        tolerance = _tolerance(before, now, resolution(bench, key.unit, key.axis, _value(before)))
        kind = _kind(_value(before), _value(now), tolerance)
    return Change(*key, before=values[0], now=values[1], tolerance=tolerance, kind=kind)


def _value(measured: Measured | MeasuredPart) -> float:
    """What never came about is as bad as can be."""
    return measured.value if measured.value is not None and isfinite(measured.value) else inf


def _tolerance(before: Measured | MeasuredPart, now: Measured | MeasuredPart, least: float) -> float | None:
    """Where one of the two noises is not known, the other stands for it."""
    known = [measured.noise for measured in (before, now) if measured.noise is not None]
    if not known:
        return None
    return max(TIMES_NOISE * hypot(known[0], known[-1]), least) * (1.0 + _ROUNDING)


def _kind(before: float, now: float, tolerance: float | None) -> Kind:
    if before == now:
        return Kind.WITHIN_NOISE
    worse = now - before
    if tolerance is None and isfinite(worse):
        return Kind.NOISE_UNKNOWN
    if abs(worse) <= (tolerance or 0.0):
        return Kind.WITHIN_NOISE
    return Kind.REGRESSION if worse > 0.0 else Kind.IMPROVEMENT


def _outcomes(cases: Iterable[CaseResult | CasePart]) -> dict[str, Outcome]:
    return {case_name(case): case.outcome for case in cases}


def _changed_cases(before: Mapping[str, Outcome], now: Mapping[str, Outcome]) -> tuple[CaseChange, ...]:
    names = dict.fromkeys((*now, *before))
    changes = (CaseChange(name, before.get(name), now.get(name)) for name in names)
    return tuple(change for change in changes if change.before is not change.now)
