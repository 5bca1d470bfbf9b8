"""What is selected and how probable it is called, held against what is there: strictly, and by the contract's event.

Strictly no answer counts for another. By the contract a probability is of the effect "or one of those that it is
indistinguishable from": what the fit has shown to be indistinguishable from a true effect counts as there (`alike.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.blind.claims import claims
from drivetwin.blind.judge import Judged
from drivetwin.blind.rates import Rate, rate

TENTHS = tuple((tenth / 10.0, (tenth + 1) / 10.0) for tenth in range(10))


@dataclass(frozen=True)
class Called:
    """Answers that were called with a probability from `low` (inclusive) to `high`: its mean, how many were right."""

    low: float
    high: float
    mean: float | None
    right: Rate


@dataclass(frozen=True)
class Strict:
    """Figures of the answers given with one kind of nominal parameters.

    `exact_first`: of singles, the first cause is the true one itself; `alike_first`: it is not, but names the true one among
    what it cannot be distinguished from; `beside_the_model`: the first that is no parameter of the model which is off, or is a
    true one, is one of these two; `there_first`: of singles, pairs and fours, the first cause is there, if only as a
    nuisance. `absent`: of all effects selected, those that are not there. `worse`: of all axes, those whose gap on validation
    motion grew. `covered`: of all parameters told of effects that are there, those whose 90 % interval holds the truth.
    `reliability`: of every cause told, by its probability in tenths, how many are there; `brier` of the same. `share_error`:
    median distance of a true cause's told share of the gap from the true one; None where none is told.
    """

    exact_first: Rate
    alike_first: Rate
    beside_the_model: Rate
    there_first: Rate
    all_four: Rate
    absent: Rate
    worse: Rate
    covered: Rate
    reliability: tuple[Called, ...]
    brier: float | None
    share_error: float | None


@dataclass(frozen=True)
class OrAlike:
    """The same figures by the event of the contract: what truly cannot be told from something that is there counts as there.

    `claims`: of the claims to be indistinguishable from a true effect that were tried by the fit, those that hold; `untried`:
    how many were not tried, and count as wrong.
    """

    absent: Rate
    reliability: tuple[Called, ...]
    brier: float | None
    claims: Rate
    untried: int


def or_alike(judged: Sequence[Judged]) -> OrAlike:
    """All figures by the event of the contract."""
    events = [event for one in judged for event in one.events_or_alike]
    open_claims = [(one, claims(one.case, one.answer.report)) for one in judged]
    return OrAlike(
        absent=rate(chosen not in one.case.there | one.stands_for for one in judged for chosen in one.selected),
        reliability=calibration(events, TENTHS),
        brier=brier(events),
        claims=Rate(sum(len(one.answer.alike) for one in judged), sum(one.answer.checked for one in judged)),
        untried=sum(len(asked) for one, asked in open_claims if one.answer.checked == 0),
    )


def strict(judged: Sequence[Judged]) -> Strict:
    """All strict figures."""
    single = [one for one in judged if one.case.kind == "single"]
    in_library = [one for one in judged if one.case.kind in ("single", "double", "four")]
    events = [event for one in judged for event in one.events]
    errors = [error for one in in_library for error in one.share_errors]
    return Strict(
        exact_first=rate(one.first_is_exact for one in single),
        alike_first=rate(one.first_is_true and not one.first_is_exact for one in single),
        beside_the_model=rate(one.first_beside_the_model_is_true for one in single),
        there_first=rate(one.first_is_there for one in in_library),
        all_four=rate(one.right for one in judged if one.case.kind == "four"),
        absent=rate(chosen not in one.case.there for one in judged for chosen in one.selected),
        worse=rate(worse for one in judged for worse in one.made_worse),
        covered=rate(held for one in judged for held in one.covered),
        reliability=calibration(events, TENTHS),
        brier=brier(events),
        share_error=float(np.median(errors)) if errors else None,
    )


def calibration(called: Sequence[tuple[float, bool]], bins: Sequence[tuple[float, float]]) -> tuple[Called, ...]:
    """Answers by the probability that they were called with; the last of `bins` holds its upper end."""
    return tuple(
        _called(low, high, [(p, right) for p, right in called if low <= p < high or p == high == 1.0]) for low, high in bins
    )


def _called(low: float, high: float, called: list[tuple[float, bool]]) -> Called:
    mean = float(np.mean([p for p, _ in called])) if called else None
    return Called(low, high, mean, rate(right for _, right in called))


def brier(called: Sequence[tuple[float, bool]]) -> float | None:
    """Mean squared difference of a probability and whether it was right (Brier 1950, two classes)."""
    return float(np.mean([(p - right) ** 2 for p, right in called])) if called else None
