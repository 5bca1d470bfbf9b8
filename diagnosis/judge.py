"""From a selection to the report's values: gap, causes with their shrink, verdict, and the patched simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.comparison import Comparison
from diagnosis.deviations import Deviation, Off, as_effects, deviations, groups
from diagnosis.distinguish import ALIKE, alike, tell_apart
from diagnosis.gap_test import NAME, gap_of
from diagnosis.hypotheses import in_place_of
from diagnosis.measured import Run
from diagnosis.noise import Noise
from diagnosis.patch import bearable, patch_of, patch_of_deviations, together
from diagnosis.patched_model import patched_xml
from diagnosis.patterns import patterns
from diagnosis.placing import in_order, placed
from diagnosis.prediction import Patch, gap_rms, predict
from diagnosis.probability import Answer, Unseen, answers_of, answers_of_deviation
from diagnosis.result import (
    NONE,
    TWO_SIDED_90,
    UNKNOWN,
    AxisGap,
    Cause,
    Diagnosis,
    Estimate,
    FittedGap,
    Prediction,
    Shrink,
    Verdict,
)
from diagnosis.selection import Selection, Step
from diagnosis.settings import DiagnosisSettings
from diagnosis.shrink import shrink
from diagnosis.simulation import Simulation
from diagnosis.spread import intervals
from diagnosis.state import State
from diagnosis.where import regimes
from diagnosis.wording import fitted_note
from drivetwin.errors import UserError
from emulator.effects import AxisEffect, ModelEffect, PlacedEffect
from emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from emulator.effects.gravity import Gravity
from emulator.effects.payload import Payload
from emulator.effects.torque_offset import TorqueOffset

SHOWN = 0.002
"""Probability below which an answer is left out; what is left out is given to the others."""
AS_WELL: dict[type[ModelEffect] | type[AxisEffect], float] = {
    Payload: 8.0, TorqueOffset: ALIKE, CoulombAsymmetry: ALIKE, Gravity: ALIKE
}  # fmt: skip
"""Nats by which an effect may be less evident than a body whose weight is misjudged, to be named beside it."""
EXPLAINED, PARTLY = 0.9, 0.3
"""Shares of what can be explained, from which a gap is called so."""


class Judge:
    """Turns a selection into the report's values, measured on the validation recordings but for gaps that these do not show."""

    def __init__(
        self,
        twin: Simulation,
        comparison: Comparison,
        unseen: Comparison,
        selection: Selection,
        runs: Sequence[Run],
        checks: Sequence[Run],
        noise: Mapping[str, Noise],
        settings: DiagnosisSettings,
        standstill: Mapping[str, float],
        held_back: bool,
    ) -> None:
        self.twin, self.comparison = twin, comparison
        self.selection = replace(selection, deviations=bearable(comparison, selection))
        self.runs, self.checks, self.noise = runs, checks, noise
        self.settings, self.standstill, self.held_back = settings, standstill, held_back
        self.units = {axis: "N" if twin.slides(axis) else "N·m" for axis in twin.axes}
        self.patch = patch_of(comparison, self.selection)
        floors = {axis: one.floor for axis, one in noise.items()}
        self._predict()
        only_fitted = {axis: gap_rms(self.fitted, axis) for axis in self.found if self.found[axis].on_fitted_only}
        self.unseen = Unseen(unseen, self.predictions, floors, only_fitted)

    def _predict(self) -> None:
        """With the patch: the validation recordings, the fitted ones by when they began, and where each axis has a gap."""
        self.predictions = self._predicted(self.patch)
        by_time = sorted(self.runs, key=lambda run: float(run.recording.time[0]))
        self.fitted = [predict(self.twin, run, self.patch) for run in by_time]
        self.found = {
            axis: gap_of(self.predictions, self.fitted, axis, self.noise[axis].floor, self.settings.cutoff_hz)
            for axis in self.twin.axes
        }

    def _select_nothing(self) -> None:
        """The gap stays what it was, torque that a drive does not give for its loops' asking among it; nothing is closed."""
        self.patch = Patch()
        self.predictions = [_unclosed(each) for each in self.predictions]
        self.fitted = [_unclosed(each) for each in self.fitted]

    def diagnosis(self) -> Diagnosis:
        gap = any(one.significant for one in self.found.values())
        unknown = gap and answers_of(self.selection.steps[0], self.selection, self.unseen)[0].effect == UNKNOWN
        if unknown or not gap:
            self._select_nothing()
        axes = {axis: self._axis(axis) for axis in self.twin.axes}
        after = {axis: gap_rms(self.predictions, axis, "after") for axis in self.twin.axes}
        found = Diagnosis(
            verdict=Verdict.NO_GAP,
            seed=self.settings.seed,
            cutoff_hz=self.settings.cutoff_hz,
            standstill_velocity={axis: speed for axis, speed in self.standstill.items() if np.isfinite(speed)},
            axes=axes,
            causes=tuple(self._causes(gap, unknown)),
            selected=self._selected(gap),
            after_rms=after,
            predictions=tuple(self.predictions),
            model_xml=patched_xml(self.twin, self.patch.heavier or {}),
            held_back=self.held_back,
            units=self.units,
            fitted={axis: self._fitted_gap(axis) for axis, one in self.found.items() if one.on_fitted_only},
        )
        notes = tuple(fitted_note(found, axis) for axis in found.fitted)
        return replace(found, verdict=_verdict(found), notes=notes)

    def _fitted_gap(self, axis: str) -> FittedGap:
        torque = _torque_rms(self.fitted, axis)
        return FittedGap(torque, gap_rms(self.fitted, axis), gap_rms(self.fitted, axis, "after"), tuple(self.fitted))

    def _predicted(self, patch: Patch) -> list[Prediction]:
        return [predict(self.twin, run, patch) for run in self.checks]

    def _axis(self, axis: str) -> AxisGap:
        noise, speed, found = self.noise[axis], self.standstill[axis], self.found[axis]
        shown = self.fitted if found.on_fitted_only else self.predictions
        parts = [each.axes[axis] for each in self.predictions]
        still = np.concatenate([(part.measured - part.before)[~part.used] for part in parts])
        return AxisGap(
            torque_rms=_torque_rms(self.predictions, axis),
            gap_rms=gap_rms(self.predictions, axis),
            noise_rms=noise.floor,
            noise_found_by=noise.found_by,
            standstill_rms=float(np.sqrt(np.mean(still**2))) if still.size else 0.0,
            significant=found.significant,
            test=f"{NAME}{self._only_fitted(axis)}",
            p_value=found.p_value,
            where=regimes(shown, axis, noise.floor, speed) if np.isfinite(speed) else (),
            patterns=patterns(shown, axis, noise.floor, self.settings.cutoff_hz, self.units[axis]) if found.significant else (),
        )

    def _only_fitted(self, axis: str) -> str:
        """For readers of report.json, which has no other place for it."""
        if not self.found[axis].on_fitted_only:
            return ""
        before, after = gap_rms(self.fitted, axis), gap_rms(self.fitted, axis, "after")
        unit = self.units[axis]
        return f"; the gap is on the fitted motion only, {before:.3g} {unit} rms there, {after:.3g} {unit} with the effects"

    def _selected(self, gap: bool) -> tuple[PlacedEffect, ...]:
        """In the order in which they were found."""
        if not gap:
            return ()
        found = [(step.chosen.effect, step.chosen.axis) for step in self.selection.steps if step.chosen is not None]
        return tuple(sorted(self.patch.effects, key=lambda one: _rank(found, one)))

    def _causes(self, gap: bool, unknown: bool) -> list[Cause]:
        if not gap:
            return [Cause(1, NONE, None, 1.0 - SHOWN, {}, None), Cause(1, UNKNOWN, self.twin.axes[0], SHOWN, {}, None)]
        if unknown:
            return self._step(1, self.selection.steps[0], ())
        causes: list[Cause] = []
        before: tuple[PlacedEffect, ...] = ()
        for number, step in enumerate(self.selection.steps, start=1):
            if step.chosen is None and number > 1:
                break
            causes.extend(self._step(number, step, before))
            if step.chosen is not None and step.chosen.axis is not None and step.chosen.found is not None:
                before = in_order([*before, self._final(step.chosen.effect, step.chosen.axis)])
        return [*causes, *self._deviations(len({one.step for one in causes}))]

    def _final(self, effect: str, axis: str) -> PlacedEffect:
        """As it was settled beside the other effects, on the model's own parameters."""
        return next(one for one in self.selection.effects if (one.effect.name, one.axis) == (effect, axis))

    def _step(self, number: int, step: Step, before: tuple[PlacedEffect, ...]) -> list[Cause]:
        return [self._cause(number, step, one, before) for one in _shown(answers_of(step, self.selection, self.unseen))]

    def _cause(self, number: int, step: Step, one: Answer, before: tuple[PlacedEffect, ...]) -> Cause:
        if one.effect in (UNKNOWN, NONE) or one.axis is None:
            return Cause(number, one.effect, one.axis, one.probability, {}, None)
        if one.number is None:
            return self._parameter(number, one, Patch(before), step.state)
        hypothesis = step.answers[one.number]
        assert hypothesis.found is not None
        chosen = hypothesis is step.chosen and self.patch != Patch()
        tried = self._final(one.effect, one.axis) if chosen else placed(self.comparison, one.axis, hypothesis.found.effect)
        others = alike(step.answers, hypothesis)
        return Cause(
            number,
            one.effect,
            one.axis,
            one.probability,
            intervals(self.selection.final, step.state, tried, chosen),
            self._closed(Patch(before), Patch(in_order([*before, tried])), tried.axis),
            others,
            tell_apart(one.effect, others),
        )

    def _parameter(self, number: int, one: Answer, before: Patch, state: State) -> Cause:
        """A parameter of the model as a cause; one that was not found off, with what a fit of the step's state gives."""
        assert one.axis is not None
        same = [each for each in self.selection.deviations if (each.effect, each.axis) == (one.effect, one.axis)]
        named = [each for each in groups(state.nominals) if (each.effect, each.axis) == (one.effect, one.axis)]
        own = same or deviations(state, named)
        parameters = {}
        for off in (member for each in own for member in each.members):
            value, name, unit = _told(off, self.comparison)
            half = TWO_SIDED_90 * off.deviation
            parameters[name] = Estimate(value, unit, (value - half, value + half))
        closed = self._closed(before, together(before, patch_of_deviations(self.comparison, own)), one.axis)
        others = self._as_well(one.axis, same)
        told = tell_apart(one.effect, others)
        return Cause(number, one.effect, one.axis, one.probability, parameters, closed, others, told)

    def _closed(self, before: Patch, later: Patch, axis: str) -> Shrink | None:
        if self.found[axis].on_fitted_only:  # nothing to close on the validation data
            return None
        try:
            first, last = self._predicted(before), self._predicted(later)
        except UserError:  # no mechanism with what was selected before: friction lowered beside the effects could push
            return None
        return shrink(first, last, axis, self.noise[axis].floor, self.settings.seed)

    def _as_well(self, axis: str, found: Sequence[Deviation]) -> tuple[str, ...]:
        """Instead of being misjudged a body may carry something, if it is heavier; or something else pulls as its weight."""
        state = self.selection.final
        members = [off for one in found for off in one.members]
        keys = {off.nominal.key for off in members}
        numbers = frozenset(number for number, one in enumerate(state.nominals) if one.key in keys)
        amounts = [off.amount for off in members if off.nominal.body is not None]
        if not amounts or not numbers:
            return ()
        selected = {one.effect.name for one in self.selection.effects if one.axis == axis}
        named = []
        for kind, behind in AS_WELL.items():
            if kind.name in selected or (kind is Payload and max(amounts) <= 0.0):
                continue
            gained = in_place_of(state, kind, axis, numbers)
            if gained is not None and gained > -behind:
                named.append(kind.name)
        return tuple(named)

    def _deviations(self, steps: int) -> list[Cause]:
        """A step for each parameter of the model that was found off, but for the one that the first step named."""
        causes: list[Cause] = []
        before = Patch(self.selection.effects)
        left = list(self.selection.deviations)
        named = self.selection.steps[0].chosen is None
        number = steps if named else steps + 1
        while left:
            answers = answers_of_deviation(left)
            top = answers[0]
            if not (named and number == steps):
                causes.extend(self._of_model(number, one, before) for one in _shown(answers))
            gone = [each for each in left if (each.effect, each.axis) == (top.effect, top.axis)]
            before = together(before, patch_of_deviations(self.comparison, gone))
            left = [each for each in left if each not in gone] if gone else []
            number += 1
        return causes

    def _of_model(self, number: int, one: Answer, before: Patch) -> Cause:
        if one.axis is None:
            return Cause(number, NONE, None, one.probability, {}, None)
        return self._parameter(number, one, before, self.selection.final)


def _unclosed(prediction: Prediction) -> Prediction:
    axes = {axis: replace(part, after=part.before) for axis, part in prediction.axes.items()}
    return replace(prediction, axes=axes)


def _verdict(found: Diagnosis) -> Verdict:
    """From the share that the patch takes of what can be explained, on the axis on which that is least."""
    shares = []
    for axis in found.axes:
        gap, after = found.told(axis)
        if gap.significant:
            explainable = max(gap.gap_rms**2 - gap.noise_rms**2, 1e-12 * gap.gap_rms**2)
            shares.append(1.0 - max(after**2 - gap.noise_rms**2, 0.0) / explainable)
    if not shares:
        return Verdict.NO_GAP
    least = min(shares)
    return Verdict.EXPLAINED if least >= EXPLAINED else Verdict.PARTLY_EXPLAINED if least >= PARTLY else Verdict.UNEXPLAINED


def _torque_rms(predictions: Sequence[Prediction], axis: str) -> float:
    torque = np.concatenate([each.axes[axis].measured[each.axes[axis].used] for each in predictions])
    return float(np.sqrt(np.mean(torque**2))) if torque.size else 0.0


def _told(one: Off, comparison: Comparison) -> tuple[float, str, str]:
    """Value, name and unit of the parameter that a deviation gives."""
    nominal = one.nominal
    if nominal.effect is None or nominal.axis is None:
        return 1.0 + one.amount, f"mass_scale_{comparison.simulation.model.body(nominal.body).name}", "1"
    own = as_effects(comparison, [Deviation(nominal.effect, nominal.axis, (one,), 0.0)])[0]
    parameter = type(own.effect).parameters[0].name
    return float(getattr(own.effect, parameter)), parameter, own.units[parameter]


def _rank(found: Sequence[tuple[str, str | None]], one: PlacedEffect) -> int:
    key = (one.effect.name, one.axis)
    return found.index(key) if key in found else len(found)


def _shown(answers: Sequence[Answer]) -> list[Answer]:
    """Those worth a line, and always the first; they add up to 1 again."""
    kept = [one for one in answers if one.probability >= SHOWN] or list(answers[:1])
    whole = sum(one.probability for one in kept)
    return [replace(one, probability=one.probability / whole) for one in kept]
