"""The score of a blind test: how often right, how far the gap shrank, whether the promises held."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from drivetwin.blind.answer import Answer
from drivetwin.blind.case import FOREIGN, Case, Kind
from drivetwin.blind.judge import Judged
from drivetwin.blind.rates import Rate, rate
from drivetwin.blind.strict import Called, OrAlike, Strict, brier, calibration, or_alike, strict

POINTS_LESS = 0.05
"""What nominal parameters that are off may cost a rate."""

_SEVERAL = ("double", "four")
_BINS = ((0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.0))


@dataclass(frozen=True)
class Target:
    """A promised figure: `value` is a share over `of` cases (or the median of as many shares); None without any."""

    name: str
    words: str
    nominal: str
    value: float | None
    ci90: tuple[float, float] | None
    of: int
    wanted: float

    @property
    def reached(self) -> bool | None:
        """Whether the figure is what was promised; None where there is no case to tell."""
        return None if self.value is None else self.value >= self.wanted


@dataclass(frozen=True)
class Named:
    """A rate and what it is of."""

    name: str
    rate: Rate


@dataclass(frozen=True)
class Confused:
    """How many cases of one truth got one answer."""

    truth: str
    answer: str
    count: int


@dataclass(frozen=True)
class Miss:
    """A case whose answer is not right."""

    number: int
    kind: str
    machine: str
    formulation: str
    truth: str
    answer: str
    probability: float | None
    failed: str | None


@dataclass(frozen=True)
class Extra:
    """A case of which effects were selected that are not there, `effect@axis` each."""

    number: int
    machine: str
    truth: str
    others: tuple[str, ...]


@dataclass(frozen=True)
class NominalScore:
    """All figures of the diagnoses with one kind of nominal parameters.

    `shrinks`: closed share of the explainable energy, one value an axis that has an effect of the library. `promises`: how many
    promised intervals held the shrink on fresh motion. `nothing_else`: of the answers to cases with an effect of the library,
    how many selected none that is not there.
    """

    nominal: str
    effect_first: Rate
    effect_first_any_axis: Rate
    axis_first: Rate
    clean: Rate
    foreign: Rate
    both: Rate
    one_of_two_first: Rate
    nothing_else: Rate
    shrinks: tuple[float, ...]
    promises: Rate
    calibration: tuple[Called, ...]
    brier: float | None
    by_effect: tuple[Named, ...]
    by_machine: tuple[Named, ...]
    by_formulation: tuple[Named, ...]
    confusion: tuple[Confused, ...]
    misses: tuple[Miss, ...]
    strict: Strict
    or_alike: OrAlike
    extras: tuple[Extra, ...]

    @property
    def median_shrink(self) -> float | None:
        """Median of `shrinks`; None without any."""
        return float(np.median(self.shrinks)) if self.shrinks else None

    @property
    def targets(self) -> tuple[Target, ...]:
        """What was promised, and what came of it."""
        less = POINTS_LESS if self.nominal == "off" else 0.0
        shares = (
            ("effect_first", "single: right effect first", self.effect_first, 0.95 - less),
            ("axis_first", "single: right axis first", self.axis_first, 0.99 - less),
            ("clean", "clean: no gap", self.clean, 0.98 - less),
            ("foreign", "foreign: unknown first", self.foreign, 0.90 - less),
            ("both", "double: both selected", self.both, 0.85 - less),
            ("promises", "promised interval of the shrink holds on fresh motion", self.promises, 0.90),
        )
        counted = tuple(
            Target(name, words, self.nominal, share.value, share.ci90, share.of, round(wanted, 2))
            for name, words, share, wanted in shares
        )
        words = "explainable gap closed on validation motion, median"
        shrink = Target("shrink", words, self.nominal, self.median_shrink, None, len(self.shrinks), 0.95)
        return (*counted[:-1], shrink, counted[-1])


@dataclass(frozen=True)
class Score:
    """A scored run; `code` is the hash of the code that answered."""

    seed: int
    cases: int
    commitment: str
    code: str
    nominal: tuple[NominalScore, ...]

    @property
    def targets(self) -> tuple[Target, ...]:
        """What was promised of the whole run."""
        return tuple(target for score in self.nominal for target in score.targets)


def score_nominal(nominal: str, cases: Sequence[Case], answers: Sequence[Answer]) -> NominalScore:
    """Score the answers to `cases`, in the same order, that were given with one kind of nominal parameters."""
    judged = [Judged(case, answer, nominal) for case, answer in zip(cases, answers, strict=True)]
    of_kind = {kind: [one for one in judged if one.case.kind == kind] for kind in get_args(Kind)}
    in_library = of_kind["single"] + of_kind["double"] + of_kind["four"]
    promised = [promise for one in judged if (promise := one.promised_and_found) is not None]
    return NominalScore(
        nominal=nominal,
        effect_first=rate(one.right for one in of_kind["single"]),
        effect_first_any_axis=rate(one.effect_is_true for one in of_kind["single"]),
        axis_first=rate(one.axis_is_true for one in of_kind["single"]),
        clean=rate(one.right for one in of_kind["clean"]),
        foreign=rate(one.right for one in of_kind["foreign"]),
        both=rate(one.right for one in of_kind["double"]),
        one_of_two_first=rate(one.first_is_true for one in of_kind["double"]),
        nothing_else=rate(not one.others_selected for one in in_library if one.answer.report is not None),
        shrinks=tuple(shrink for one in in_library for shrink in one.shrinks),
        promises=rate(low <= gap.closed <= high for (low, high), gap in promised),
        calibration=calibration(_first_calls(judged), _BINS),
        brier=brier(_first_calls(judged)),
        by_effect=_by([one for one in judged if one.case.kind not in _SEVERAL], lambda one: one.truth),
        by_machine=_by(judged, lambda one: one.case.machine),
        by_formulation=_by(judged, lambda one: one.case.formulation),
        confusion=_confusion(judged),
        misses=tuple(_miss(one) for one in judged if not one.right),
        strict=strict(judged),
        or_alike=or_alike(judged),
        extras=tuple(
            Extra(one.case.number, one.case.machine, one.truth, others)
            for one in in_library
            if (others := one.others_selected)
        ),
    )


def _first_calls(judged: Sequence[Judged]) -> list[tuple[float, bool]]:
    """Of every case with an answer to "which" its probability, and whether what it speaks of is so."""
    return [(one.first.probability, one.promise_is_right) for one in judged if one.first is not None]


def _by(judged: Sequence[Judged], name: Callable[[Judged], str]) -> tuple[Named, ...]:
    """How many are right, by name."""
    groups: dict[str, list[bool]] = {}
    for one in judged:
        groups.setdefault(name(one), []).append(one.right)
    return tuple(Named(group, rate(right)) for group, right in sorted(groups.items()))


def _confusion(judged: Sequence[Judged]) -> tuple[Confused, ...]:
    """Of cases with at most one cause."""
    counts = Counter((one.truth, one.named) for one in judged if one.case.kind not in _SEVERAL)
    return tuple(Confused(truth, answer, count) for (truth, answer), count in sorted(counts.items()))


def _miss(one: Judged) -> Miss:
    case = one.case
    probability = one.first.probability if one.first else None
    report = one.answer.report
    chosen = " + ".join(entry.effect for entry in report.selected) if report and case.kind in _SEVERAL else one.named
    return Miss(case.number, case.kind, case.machine, case.formulation, one.truth, chosen, probability, one.answer.failed)


def order_of_answers(confusion: Sequence[Confused]) -> tuple[list[str], list[str]]:
    """Rows (library, foreign, none) and columns (the same effects first, then other answers) of a confusion table."""
    truths = sorted({cell.truth for cell in confusion}, key=lambda name: (name == "none", name.startswith(FOREIGN), name))
    answers = {cell.answer for cell in confusion}
    return truths, [*(name for name in truths if name in answers), *sorted(answers - set(truths))]


def score(
    cases: Sequence[Case], answers: Mapping[str, Sequence[Answer]], *, seed: int, commitment: str, code: str
) -> Score:
    """Score a run: by nominal, the answers in the order of `cases`."""
    by_nominal = tuple(score_nominal(nominal, cases, given) for nominal, given in answers.items())
    return Score(seed, len(cases), commitment, code, by_nominal)
