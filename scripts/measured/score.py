"""The score of an answer, and of all: right first answer, both effects, what must not be named, how much of the gap closes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from measured.cases import Label
from measured.gap import Cause, Gap
from measured.reference import Reference, closed
from measured.run import Outcome, Status

SCHEMA = "measured-score/1"
NAMED = 0.1
"""Probability above which an effect counts as named."""
WANTED = 0.9
"""Of what the reference closes, what a diagnosis should close."""
SAME = 0.02
"""Relative difference between a figure of report.json and the same one recomputed from prediction/."""


@dataclass(frozen=True)
class CaseScore:
    """One case. `strict`: the first answer is what is lacking; `right`: it is no error. None where that was not asked.

    closed, ratio: share of the gap's energy on validation that is closed, and of the reference's; None without an answer, the
    ratio also where nothing is lacking. faults: everything that must not happen, in words. settings: of the diagnosis.
    """

    name: str
    machine: str
    expected: str
    status: Status
    line: str
    seconds: float
    verdict: str | None
    first: Cause | None
    selected: tuple[str, ...]
    strict: bool
    right: bool
    right_axis: bool
    both: bool | None
    must_not: tuple[str, ...]
    closed: float | None
    reference: Reference
    ratio: float | None
    faults: tuple[str, ...]
    settings: Mapping[str, Any] | None

    @property
    def reached(self) -> bool | None:
        """Whether enough of what the reference closes is closed, and nothing made worse; None where nothing is lacking."""
        if self.expected == NOTHING:
            return None
        if self.closed is None:
            return False
        return self.ratio >= WANTED if self.ratio is not None else self.closed >= 0.0

    def to_json(self) -> dict[str, Any]:
        """Every figure."""
        reached = {"reached": self.reached}
        reference = asdict(self.reference) | {
            "closed": self.reference.closed,
            "closed_carried": self.reference.closed_carried,
        }
        return asdict(self) | reached | {"reference": reference}


NOTHING = "no gap"


@dataclass(frozen=True)
class Score:
    """All cases; `settings` are those of the diagnosis, one record for all, `differing` the keys that are not alike in all."""

    code: str
    cases: tuple[CaseScore, ...]
    settings: Mapping[str, Any]
    differing: tuple[str, ...]

    @property
    def counts(self) -> dict[str, tuple[int, int]]:
        """How many, of how many that were asked."""
        two = [case for case in self.cases if case.both is not None]
        lacking = [case for case in self.cases if case.reached is not None]
        whole = len(self.cases)
        return {
            "right first answer": (sum(case.right for case in self.cases), whole),
            "strict": (sum(case.strict for case in self.cases), whole),
            "right axis": (sum(case.right_axis for case in self.cases), whole),
            "both effects selected": (sum(bool(case.both) for case in two), len(two)),
            "0.9 of the reference closed": (sum(bool(case.reached) for case in lacking), len(lacking)),
            "answered": (self._ended(Status.ANSWERED), whole),
            "refused": (self._ended(Status.REFUSED), whole),
            "crashed": (self._ended(Status.CRASHED), whole),
            "not run": (self._ended(Status.NOT_RUN), whole),
            "with a fault": (sum(bool(case.faults) for case in self.cases), whole),
        }

    def _ended(self, status: Status) -> int:
        return sum(case.status is status for case in self.cases)

    @property
    def summary(self) -> str:
        """The counts in a line."""
        (right, whole), (strict, _) = self.counts["right first answer"], self.counts["strict"]
        rest = [f"{name} {hits}" for name in ("refused", "crashed", "not run") if (hits := self.counts[name][0])]
        return "; ".join([f"right first answer {right} of {whole} (strict {strict})", *rest])

    @property
    def crashed(self) -> bool:
        """Whether any case did."""
        return self._ended(Status.CRASHED) > 0

    def to_json(self) -> dict[str, Any]:
        """score.json."""
        counts = {name: {"count": hits, "of": of} for name, (hits, of) in self.counts.items()}
        return {
            "schema": SCHEMA,
            "code": self.code,
            "counts": counts,
            "settings": dict(self.settings),
            "settings_differ_in": list(self.differing),
            "cases": {case.name: case.to_json() for case in self.cases},
        }


def score_case(
    name: str, machine: str, label: Label, outcome: Outcome, gap: Gap | None, held_against: Reference, broken: str = ""
) -> CaseScore:
    """Score an answer; `gap` is None where there is none. `broken` says what is wrong with its prediction/, if anything."""
    first = gap.causes[0] if gap is not None and gap.causes else None
    strict, right = (False, False) if gap is None else _right(label, gap, first)
    must_not = () if gap is None else _must_not(label, gap)
    share = None if gap is None else _closed(gap)
    comparable = share is not None and bool(label.effects) and held_against.closed > 0.0
    return CaseScore(
        name=name,
        machine=machine,
        expected=_expected(label),
        status=outcome.status,
        line=outcome.line,
        seconds=outcome.seconds,
        verdict=None if gap is None else gap.verdict,
        first=first,
        selected=() if gap is None else tuple(effect for effect, _ in gap.selected),
        strict=strict,
        right=right,
        right_axis=first.axis in label.axes if first is not None and label.axes else right,
        both=_both(label, gap) if len(label.effects) > 1 else None,
        must_not=must_not,
        closed=share,
        reference=held_against,
        ratio=held_against.closed_by_diagnosis / held_against.closed if comparable else None,
        faults=tuple(_faults(outcome, must_not, gap, held_against, broken)),
        settings=None if gap is None else gap.settings,
    )


def score(code: str, cases: Sequence[CaseScore]) -> Score:
    """All of them, as this code answered them."""
    settings = [case.settings for case in cases if case.settings is not None]
    keys = dict.fromkeys(key for each in settings for key in each)
    alike = {key: [each.get(key) for each in settings] for key in keys}
    differing = tuple(key for key, values in alike.items() if any(value != values[0] for value in values))
    same = {key: values[0] for key, values in alike.items() if key not in differing}
    return Score(code, tuple(cases), same, differing)


def _expected(label: Label) -> str:
    return " + ".join(lacking.effect for lacking in label.effects) or NOTHING


def _right(label: Label, gap: Gap, first: Cause | None) -> tuple[bool, bool]:
    """Whether the first answer is what is lacking, and whether it is no error."""
    if not label.effects:
        silent = gap.verdict == "no_gap"
        nothing_else = all(effect in label.also for effect, _ in gap.selected)
        return silent and not gap.selected, nothing_else and (silent or (first is not None and first.effect in label.also))
    if first is None or first.axis not in label.axes:
        return False, False
    return first.effect in label.strict, first.effect in label.accepted


def _both(label: Label, gap: Gap | None) -> bool:
    selected = set() if gap is None else set(gap.selected)
    return all(any((name, lacking.axis) in selected for name in lacking.names) for lacking in label.effects)


def _must_not(label: Label, gap: Gap) -> tuple[str, ...]:
    named = [cause for cause in gap.causes if cause.effect in label.must_not and cause.probability > NAMED]
    return tuple(f"{cause.effect} {cause.probability:.2f}" for cause in named)


def _closed(gap: Gap) -> float:
    """Of all axes together."""
    before, after = zip(*((each.before, each.after) for each in gap.axes.values()), strict=True)
    return closed(math.hypot(*before), math.hypot(*after))


def _faults(outcome: Outcome, must_not: Sequence[str], gap: Gap | None, reference: Reference, broken: str) -> list[str]:
    faults = [f"{outcome.status}: {outcome.line}"] if outcome.status in (Status.REFUSED, Status.CRASHED) else []
    faults += [f"names {each}" for each in must_not]
    if gap is None:
        return faults
    for axis, each in gap.axes.items():
        if each.after > each.before:
            faults.append(f"makes the validation of {axis} worse: {each.before:.4g} to {each.after:.4g}")
    if broken:
        return [*faults, broken]
    (one, *others) = gap.axes.values()
    figures = (("gap_rms", one.before, reference.before), ("after", one.after, reference.diagnosed))
    return faults + [
        f"{name} is {told:.4g} in report.json and {found:.4g} in prediction/"
        for name, told, found in figures
        if not others and abs(told - found) > SAME * max(told, found)
    ]
