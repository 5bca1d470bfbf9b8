"""Results in words: case names, quantities with units, failures; the same in every file."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from typing import Protocol

from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.verdict import CaseResult, Failure, Measured, Outcome

DIGITS = 4
"""Of a quantity that are shown."""

NEVER = "never"
"""Instead of a quantity that never came about, such as the settling time of an axis that does not settle."""
_NO_UNIT = "1"
_SCALED = frozenset({"m", "rad", "s", "m/s", "rad/s"})
_PREFIXES = ((0.1, 1.0, ""), (1e-4, 1e3, "m"), (1e-7, 1e6, "µ"), (0.0, 1e9, "n"))
_WORLDS_APART = 0.01


class Numbered(Protocol):
    """A case, from this run or from a results.json."""

    @property
    def number(self) -> int:
        """Of its group."""

    @property
    def group(self) -> str:
        """Its group's name."""

    @property
    def name(self) -> str:
        """Its own name within the group."""


def suite_name(case: Numbered) -> str:
    """`04_moves`: sorts as the machine comes alive."""
    return f"{case.number:02d}_{case.group}"


def case_name(case: Numbered) -> str:
    """`04_moves.tracking`: the same from release to release."""
    return f"{suite_name(case)}.{case.name}"


def quantity(value: float, unit: str) -> str:
    """`0.52 mm`: with the prefix that the value asks for."""
    return _together((value,), unit)[0]


def against(value: float, limit: float, unit: str) -> str:
    """`0.52 mm, limit 0.5 mm`: both with one prefix, unless they are worlds apart."""
    if abs(value) < _WORLDS_APART * abs(limit):
        return f"{quantity(value, unit)}, limit {quantity(limit, unit)}"
    measured, allowed = _together((value, limit), unit)
    return f"{measured}, limit {allowed}"


def _together(values: Iterable[float], unit: str) -> list[str]:
    """The values in one unit, that of the largest; what never came about has none."""
    values = list(values)
    largest = max((abs(value) for value in values if isfinite(value)), default=0.0)
    factor, prefix = 1.0, ""
    if unit in _SCALED and largest > 0.0:
        factor, prefix = next((factor, prefix) for least, factor, prefix in _PREFIXES if largest >= least)
    shown = "" if unit == _NO_UNIT else f" {prefix}{unit}"
    return [f"{factor * value:.{DIGITS}g}{shown}".rstrip() if isfinite(value) else NEVER for value in values]


def quantity_name(name: str, axis: str | None) -> str:
    """`tracking error, rotate`."""
    words = name.replace("_", " ")
    return f"{words}, {axis}" if axis else words


def measured_words(measured: Measured) -> str:
    """`tracking error, rotate: 0.52 mrad, limit 1 mrad`."""
    value = quantity(measured.value, measured.unit)
    if measured.limit is not None:
        value = against(measured.value, measured.limit, measured.unit)
    return f"{quantity_name(measured.name, measured.axis)}: {value}"


def failure_words(failure: Failure) -> str:
    """`stopped: still moves (rotate, at 3.412 s, 0.2 rad/s, limit 10 mrad/s)`."""
    facts = [failure.axis] if failure.axis else []
    if failure.time is not None:
        facts.append(f"at {failure.time:.3f} s")
    if failure.measured is not None and failure.limit is not None:
        facts.append(against(failure.measured, failure.limit, failure.unit))
    elif failure.measured is not None:
        facts.append(quantity(failure.measured, failure.unit))
    said = f"{failure.expectation.replace('_', ' ')}: {failure.message}"
    return f"{said} ({', '.join(facts)})" if facts else said


def caveats(case: CaseResult) -> tuple[str, ...]:
    """`not judged, for want of the plant's truth: holds, no jump`; `run twice: ...`; nothing where nothing is to be said."""
    listed = ", ".join(name.replace("_", " ") for name in case.not_judged)
    times = "twice" if case.tries == 2 else f"{case.tries} times"
    found = [
        f"not judged, for want of the plant's truth: {listed}" if listed else "",
        f"run {times}: before, the stand stood still itself where it was rejected" if case.tries > 1 else "",
    ]
    return tuple(filter(None, found))


def skipped_words(cases: Iterable[CaseResult]) -> str:
    """`2 of 08_faults, all of 11_soak`."""
    found: dict[str, list[bool]] = {}
    for case in cases:
        found.setdefault(suite_name(case), []).append(case.outcome is Outcome.SKIPPED)
    told = (f"{'all' if all(skipped) else sum(skipped)} of {name}" for name, skipped in found.items() if any(skipped))
    return ", ".join(told)


def verdict_sentence(acceptance: Acceptance, worse: int = 0) -> str:
    """`Rejected: 2 of 31 cases failed, 3 skipped (2 of 08_faults, all of 11_soak).`

    `worse` figures are so than the baseline by more than noise.
    """
    rejected, skipped = (len(acceptance.of(outcome)) for outcome in (Outcome.REJECTED, Outcome.SKIPPED))
    judged = len(acceptance.cases) - skipped
    left_out = f", {skipped} skipped ({skipped_words(acceptance.cases)})" if skipped else ""
    figures = f"{worse} figure{'s are' if worse > 1 else ' is'} worse than the baseline by more than noise"
    if rejected:
        return f"Rejected: {rejected} of {judged} cases failed{left_out}{f'; {figures}' if worse else ''}."
    if not judged:
        return f"Not accepted: no case was judged{left_out}."
    if acceptance.wanting:
        wanting = ", ".join(acceptance.wanting)
        return f"Not accepted: the bench needs {wanting}, of which no case was judged; {judged} others passed{left_out}."
    passed = f"all of {judged} cases passed{left_out}"
    return f"Rejected: {passed}, but {figures}." if worse else f"Accepted: {passed}."
