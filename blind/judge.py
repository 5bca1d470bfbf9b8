"""The rules by which one answer is right or wrong, each on its own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import pi

from drivetwin.blind.answer import Answer, Gap
from drivetwin.blind.case import FOREIGN, Case, Cause
from drivetwin.blind.told import NO_GAP, NONE, UNKNOWN, ToldCause, ToldEstimate
from drivetwin.emulator.effects import library

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
    def first(self) -> ToldCause | None:
        """The answer to "which"."""
        return self.answer.report.first if self.answer.report else None

    @property
    def right(self) -> bool:
        """The rule of the case's kind."""
        match self.case.kind:
            case "clean":
                return self._clean()
            case "foreign":
                return self._foreign()
            case "single":
                return self.first_is_true
            case "double" | "four":
                return self.all_selected

    def _clean(self) -> bool:
        """No gap; where nominal parameters are off: nothing named but what these are."""
        report = self.answer.report
        if report is None:
            return False
        if self.nominal == "exact":
            return report.verdict == NO_GAP
        named = {cause.effect for cause in report.leading} | {entry.effect for entry in report.selected}
        return all(name == NONE or of_the_model(name) for name in named)

    def _foreign(self) -> bool:
        """`unknown` takes the largest share of the gap of the axis; comes first in a report without shares."""
        report = self.answer.report
        if report is None:
            return False
        told = report.axes.get(self.case.causes[0].axis)
        return told.largest == UNKNOWN if told is not None and told.shares else self.named == UNKNOWN

    @property
    def first_is_exact(self) -> bool:
        """The first cause is itself a true one on its axis."""
        return self.first is not None and (self.first.effect, self.first.axis) in _named(self.case.causes)

    @property
    def first_is_there(self) -> bool:
        """The first cause is there on its axis, if only as a nuisance."""
        return self.first is not None and (self.first.effect, self.first.axis) in self.case.there

    @property
    def first_beside_the_model_is_true(self) -> bool:
        """Where nominal parameters are off, of the first cause that is none of them, or a true one; else as `first_is_true`.

        A mass that is 4 % off takes more of a lift's gap than many a cause, and rightly comes before it.
        """
        causes = self.answer.report.causes if self.first is not None and self.answer.report is not None else []
        true = ((told, any(self.covers(told, cause) for cause in self.case.causes)) for told in causes)
        return next((is_true for told, is_true in true if is_true or self._counts(told.effect)), False)

    @property
    def first_is_true(self) -> bool:
        """The first cause is a true effect on its axis, or one that the data cannot tell from it, says so, and is so."""
        first = self.first
        return first is not None and any(self.covers(first, cause) for cause in self.case.causes)

    @property
    def effect_is_true(self) -> bool:
        """The same, whatever the axis."""
        first = self.first
        return first is not None and any(
            cause.effect == first.effect or self.covers(first, cause) for cause in self.case.causes
        )

    @property
    def axis_is_true(self) -> bool:
        """The first cause is on an axis that has an effect."""
        return self.first is not None and self.first.axis in {cause.axis for cause in self.case.causes}

    @property
    def all_selected(self) -> bool:
        """Every true effect was selected on its axis, itself or one that says that it cannot be told from it, and is so."""
        report = self.answer.report
        if report is None:
            return False
        selected = {(entry.effect, entry.axis) for entry in report.selected}
        chosen = [cause for cause in report.causes if (cause.effect, cause.axis) in selected]
        return all(
            (cause.effect, cause.axis) in selected or any(self.covers(named, cause) for named in chosen)
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
        as_good = {(told.effect, told.axis) for told in report.causes if any(self.covers(told, cause) for cause in open_ones)}
        return tuple(
            f"{one.effect}@{one.axis}"
            for one in report.selected
            if (one.effect, one.axis) not in true | as_good and not (self.nominal == "off" and of_the_model(one.effect))
        )

    def covers(self, named: ToldCause, truth: Cause) -> bool:
        """Whether the answer is the true effect on its axis, or says that the data cannot tell the two apart and is right."""
        if named.axis != truth.axis:
            return False
        return named.effect == truth.effect or (named.effect, named.axis, truth.effect) in self.answer.alike

    @property
    def stands_for(self) -> frozenset[tuple[str, str | None]]:
        """Effect and axis of what is not there itself and truly cannot be told from something that is."""
        return frozenset((effect, axis) for effect, axis, _ in self.answer.alike)

    @property
    def selected(self) -> tuple[tuple[str, str], ...]:
        """Effect and axis of everything that was selected; without parameters of the model where these are off."""
        report = self.answer.report
        return tuple((one.effect, one.axis) for one in report.selected if self._counts(one.effect)) if report else ()

    def _counts(self, effect: str) -> bool:
        return self.nominal == "exact" or not of_the_model(effect)

    @property
    def events(self) -> tuple[tuple[float, bool], ...]:
        """By cause of the report its probability, and whether exactly this effect is on exactly this axis, nuisances included.

        `unknown` is an event where something foreign, or nothing at all, is on its axis; parameters of the model where exact.
        """
        return tuple(
            (told.probability, told.axis in self._foreign_axes if told.effect == UNKNOWN else self._is_there(told))
            for told in self._called
        )

    @property
    def _called(self) -> tuple[ToldCause, ...]:
        """The causes of a report whose probability can be held against the truth."""
        report = self.answer.report
        return tuple(
            told
            for told in (report.causes if report else ())
            if (told.effect == UNKNOWN and (told.axis in self._foreign_axes or self.case.kind == "clean"))
            or (told.effect not in (UNKNOWN, NONE) and self._counts(told.effect))
        )

    @property
    def _foreign_axes(self) -> frozenset[str | None]:
        return frozenset(cause.axis for cause in self.case.causes if cause.effect.startswith(FOREIGN))

    def _is_there(self, told: ToldCause) -> bool:
        return (told.effect, told.axis) in self.case.there

    @property
    def events_or_alike(self) -> tuple[tuple[float, bool], ...]:
        """The event of the contract: the same, and what truly cannot be told from something that is there counts as there."""
        found = []
        for told, (probability, there) in zip(self._called, self.events, strict=True):
            found.append((probability, there or (told.effect, told.axis) in self.stands_for))
        return tuple(found)

    @property
    def covered(self) -> tuple[bool, ...]:
        """Of every parameter told of an effect that is there: whether its 90 % interval holds the true value."""
        report = self.answer.report
        return tuple(
            _holds(name, estimate, truth.parameters[name])
            for told in (report.causes if report else ())
            if self._counts(told.effect) and (truth := self._meant(told)) is not None
            for name, estimate in told.parameters.items()
            if name in truth.parameters
        )

    @property
    def share_errors(self) -> tuple[float, ...]:
        """By cause that is there and whose true share of the gap is known: how far the told share is from that."""
        report = self.answer.report
        known = {(one.effect, one.axis): getattr(one, "share", None) for one in self.case.causes}
        shares = {named: share for named, share in known.items() if share is not None}
        return tuple(
            abs(told.share - shares[told.effect, told.axis])
            for told in (report.causes if report else ())
            if told.share is not None and told.axis is not None and (told.effect, told.axis) in shares
        )

    def _meant(self, told: ToldCause) -> Cause | None:
        """The true effect that a cause speaks of; of several of a kind that of the nearest order."""
        of_kind = [one for one in self.case.all_effects if (one.effect, one.axis) == (told.effect, told.axis)]
        if "order" in told.parameters and of_kind:
            order = told.parameters["order"].value
            return min(of_kind, key=lambda one: abs(one.parameters.get("order", order) - order))
        return of_kind[0] if of_kind else None

    @property
    def made_worse(self) -> tuple[bool, ...]:
        """Of every axis whether what was selected made the gap on validation motion larger."""
        return tuple(gap.after > gap.before * (1.0 + 1e-9) for gap in self.answer.gaps.values())

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
            return self.nominal == "off" and of_the_model(first.effect)
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


def of_the_model(effect: str) -> bool:
    """Whether nominal parameters that are off are rightly named as an effect."""
    return effect in library() and library()[effect].of_model


def _named(causes: Iterable[Cause]) -> frozenset[tuple[str, str]]:
    return frozenset((cause.effect, cause.axis) for cause in causes)


def _holds(name: str, told: ToldEstimate, truth: float) -> bool:
    """Whether an interval holds a value; a phase, in any turn."""
    low, high = told.ci90
    if name in ("phase", "angle"):
        truth += 2.0 * pi * round((told.value - truth) / (2.0 * pi))
    return low <= truth <= high
