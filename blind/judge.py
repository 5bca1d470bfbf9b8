"""The rules by which one answer is right or wrong, each on its own."""

from __future__ import annotations

from dataclasses import dataclass

from blind.answer import Answer, Gap, first_of_steps
from blind.case import Case, Cause
from diagnosis.report.result import UNKNOWN, Verdict
from diagnosis.report.schema import CausePart

OF_THE_MODEL = frozenset({"coulomb", "viscous", "inertia"})
"""What nominal parameters that are off are rightly named as."""

NO_ANSWER = "no answer"


@dataclass(frozen=True)
class Judged:
    """A case, what was answered to it, and with which nominal parameters."""

    case: Case
    answer: Answer
    nominal: str

    @property
    def truth(self) -> str:
        """The case's row in a table: its effect, `none`, or of two effects both."""
        return " + ".join(cause.effect for cause in self.case.causes) or NONE

    @property
    def named(self) -> str:
        """What was answered to "which": the effect of the first cause, `none` without any."""
        if self.answer.report is None:
            return NO_ANSWER
        return self.first.effect if self.first else NONE

    @property
    def first(self) -> CausePart | None:
        """The most probable cause of step 1."""
        return first_of_steps(self.answer.report).get(1) if self.answer.report else None

    @property
    def right(self) -> bool:
        """The rule of the case's kind."""
        match self.case.kind:
            case "clean":
                return self._clean()
            case "foreign":
                return self.named == UNKNOWN
            case "single":
                return self.first_is_true
            case "double":
                return self.both_selected

    def _clean(self) -> bool:
        """No gap; where nominal parameters are off: nothing named but what these are."""
        report = self.answer.report
        if report is None:
            return False
        if self.nominal == "exact":
            return report.verdict is Verdict.NO_GAP
        named = {cause.effect for cause in first_of_steps(report).values()} | {entry.effect for entry in report.selected}
        return named <= OF_THE_MODEL | {NONE}

    @property
    def first_is_true(self) -> bool:
        """The first cause is a true effect on its axis, or one that the data cannot tell from it and that says so."""
        first = self.first
        return first is not None and any(covers(first, cause) for cause in self.case.causes)

    @property
    def effect_is_true(self) -> bool:
        """The same, whatever the axis."""
        first = self.first
        return first is not None and any(
            cause.effect in {first.effect, *first.indistinguishable_from} for cause in self.case.causes
        )

    @property
    def axis_is_true(self) -> bool:
        """The first cause is on an axis that has an effect."""
        return self.first is not None and self.first.axis in {cause.axis for cause in self.case.causes}

    @property
    def both_selected(self) -> bool:
        """Every true effect was selected on its axis, itself or one that was named as indistinguishable from it."""
        report = self.answer.report
        if report is None:
            return False
        selected = {(entry.effect, entry.axis) for entry in report.selected}
        chosen = [cause for cause in report.causes if (cause.effect, cause.axis) in selected]
        return all(
            (cause.effect, cause.axis) in selected or any(covers(named, cause) for named in chosen)
            for cause in self.case.causes
        )

    @property
    def others_selected(self) -> tuple[str, ...]:
        """What was selected and is not there, as `effect@axis`; parameters of the model are there where they are off."""
        report = self.answer.report
        if report is None:
            return ()
        selected = {(one.effect, one.axis) for one in report.selected}
        true = {(cause.effect, cause.axis) for cause in self.case.causes}
        open_ones = [cause for cause in self.case.causes if (cause.effect, cause.axis) not in selected]
        as_good = {(told.effect, told.axis) for told in report.causes if any(covers(told, cause) for cause in open_ones)}
        return tuple(
            f"{one.effect}@{one.axis}"
            for one in report.selected
            if (one.effect, one.axis) not in true | as_good and not (self.nominal == "off" and one.effect in OF_THE_MODEL)
        )

    @property
    def promise_is_right(self) -> bool:
        """Whether what the first cause's probability speaks of is so: that effect on that axis, or `unknown`, or `none`."""
        first = self.first
        if first is None:
            return False
        if first.effect == UNKNOWN:
            return self.case.kind == "foreign"
        if first.effect == NONE:
            return self.case.kind == "clean"
        if self.case.kind == "clean":
            return self.nominal == "off" and first.effect in OF_THE_MODEL
        return self.first_is_true

    @property
    def shrinks(self) -> tuple[float, ...]:
        """Closed share of the explainable energy on each axis that has an effect, after the whole selection.

        0 where there is no prediction for the axis; an axis without a gap above noise is left out.
        """
        axes = dict.fromkeys(cause.axis for cause in self.case.causes)
        closed = [self.answer.gaps[axis].of_explainable if axis in self.answer.gaps else 0.0 for axis in axes]
        return tuple(share for share in closed if share is not None)

    @property
    def promised_and_found(self) -> tuple[tuple[float, float], Gap] | None:
        """The promised 90 % interval of the first cause's shrink, and its gap on fresh motion; None without a promise."""
        first = self.first
        if first is None or first.gap_closed is None or first.axis is None:
            return None
        fresh = self.answer.fresh.get(first.axis)
        return (first.gap_closed.ci90, fresh) if fresh is not None else None


def covers(named: CausePart, truth: Cause) -> bool:
    """Whether the answer is the true effect on its axis, or says that the data cannot tell the two from each other."""
    return named.axis == truth.axis and truth.effect in {named.effect, *named.indistinguishable_from}
