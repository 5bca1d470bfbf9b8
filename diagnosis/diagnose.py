"""Diagnosis: recordings to the gap of each axis, its causes step by step, and a simulation that has them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from diagnosis.comparison import Comparison
from diagnosis.deviations import Deviation, Off, as_effects, deviations, groups
from diagnosis.distinguish import alike, tell_apart
from diagnosis.gap_test import NAME, gap_of
from diagnosis.hypotheses import State, in_place_of
from diagnosis.inputs import without_position
from diagnosis.measured import Run, prepare, thresholds
from diagnosis.noise import Noise, noise_of
from diagnosis.nominal import nominal_parameters
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
from diagnosis.selection import Selection, Step, select_causes
from diagnosis.settings import DiagnosisSettings
from diagnosis.shrink import shrink
from diagnosis.simulation import Simulation, simulation
from diagnosis.spread import intervals
from diagnosis.where import regimes
from diagnosis.wording import fitted_note
from drivetwin.errors import UserError
from drivetwin.motion.axis_motion import measured_position
from drivetwin.recording.recording import Recording
from emulator.effects import PlacedEffect
from emulator.effects.payload import Payload
from emulator.effects.stribeck import Stribeck

logger = logging.getLogger(__name__)

SHOWN = 0.002
"""Probability below which an answer is left out; what is left out is given to the others."""
AS_WELL = 8.0
"""Nats by which a payload may be less evident than a body that is heavier than modelled, to be named beside it."""
EXPLAINED, PARTLY = 0.9, 0.3
HELD_BACK = 0.25
"""Share at the end of each recording that is held back where there is no validation recording."""

MANY = 4
"""Recordings, of which one in so many is held back whole."""

Progress = Callable[[str, float], None]


def diagnose(
    model: Path,
    training: Sequence[Recording],
    validation: Sequence[Recording],
    settings: DiagnosisSettings,
    progress: Progress,
) -> Diagnosis:
    """The causes of the gap, fitted on `training`, their shrink measured on `validation` (blocks held back where empty).

    Raises UserError where a recording's axes do not fit the model.
    """
    held_back = not validation
    fitted, held = _hold_back(training) if held_back else (list(training), list(validation))
    twin = simulation(model, fitted[0].info.axes)
    standstill = thresholds(twin, [*fitted, *held], settings.cutoff_hz)
    progress("filter, inverse dynamics", 0.05)
    runs = [prepare(twin, recording, settings.cutoff_hz, standstill) for recording in fitted]
    checks = [prepare(twin, recording, settings.cutoff_hz, standstill) for recording in held]
    comparison = Comparison(twin, runs, without_position(fitted))
    noise = {axis: noise_of(axis, [*runs, *checks]) for axis in twin.axes}
    selection = select_causes(
        comparison, nominal_parameters(comparison), {axis: one.floor for axis, one in noise.items()}, progress
    )
    progress("gap, shrink, intervals", 0.9)
    unseen = Comparison(twin, checks, without_position(held))
    return _Judge(twin, comparison, unseen, selection, runs, checks, noise, settings, standstill, held_back).diagnosis()


def _hold_back(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Recording]]:
    """What is fitted, and what is not: every fourth recording by speed where there are many, else the end of each.

    The slowest and the fastest are always fitted: what happens there is not to be told from the others.
    """
    if len(recordings) >= MANY:
        by_speed = sorted(recordings, key=_speed)
        held = by_speed[MANY // 2 : -1 : MANY]
        return [one for one in recordings if all(one is not other for other in held)], held
    fitted, held = [], []
    for one in recordings:
        cut = round(len(one.time) * (1.0 - HELD_BACK))
        fitted.append(_piece(one, slice(0, cut), one.name))
        held.append(_piece(one, slice(cut, None), one.name))
    return fitted, held


def _speed(one: Recording) -> float:
    """Mean speed of its fastest axis, in the axis's own unit."""
    period = one.info.sample_period
    return max(
        float(np.mean(np.abs(np.diff(measured_position(columns, period))))) / period for columns in one.columns.values()
    )


def _piece(one: Recording, span: slice, name: str) -> Recording:
    columns = {axis: {key: values[span] for key, values in named.items()} for axis, named in one.columns.items()}
    return replace(one, name=name, time=one.time[span], columns=columns)


class _Judge:
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
        self.selection = replace(selection, deviations=_bearable(comparison, selection))
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

    def diagnosis(self) -> Diagnosis:
        gap = any(one.significant for one in self.found.values())
        unknown = gap and answers_of(self.selection.steps[0], self.selection, self.unseen)[0].effect == UNKNOWN
        if (unknown or not gap) and self.patch != Patch():
            self.patch = Patch()
            self._predict()
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
            model_xml=self._model_xml(),
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
        others = self._also_payload(one.axis, own)
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

    def _also_payload(self, axis: str, found: Sequence[Deviation]) -> tuple[str, ...]:
        """A body that is heavier than the model's carries something, as well as it is misjudged."""
        state = self.selection.final
        members = [off.nominal.key for one in found for off in one.members]
        numbers = frozenset(number for number, one in enumerate(state.nominals) if one.key in members)
        heavier = any(off.nominal.body is not None and off.amount > 0.0 for one in found for off in one.members)
        if not heavier or not numbers or ("payload", axis) in {(one.effect.name, one.axis) for one in self.selection.effects}:
            return ()
        gained = in_place_of(state, Payload, axis, numbers)
        return ("payload",) if gained is not None and gained > -AS_WELL else ()

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

    def _model_xml(self) -> str:
        spec = self.twin.spec()
        bodies = {body: self.twin.model.body(body).name for body in (self.patch.heavier or {})}
        compiled = spec.compile()
        for body, share in (self.patch.heavier or {}).items():
            one = spec.body(bodies[body])
            one.mass = float(compiled.body_mass[body]) * (1.0 + share)
            one.inertia = compiled.body_inertia[body] * (1.0 + share)
            one.ipos, one.iquat = compiled.body_ipos[body], compiled.body_iquat[body]
            one.explicitinertial = True
        spec.compile()
        return str(spec.to_xml())


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


def patch_of(comparison: Comparison, selection: Selection) -> Patch:
    """The selected effects, and the parameters that were found off; a Stribeck level stands on the corrected Coulomb level."""
    corrections = patch_of_deviations(comparison, selection.deviations)
    coulomb = {one.axis: one.members[0].amount for one in selection.deviations if one.effect == "coulomb"}
    effects = [
        replace(one, effect=replace(one.effect, static_torque=one.effect.static_torque + coulomb.get(one.axis, 0.0)))
        if isinstance(one.effect, Stribeck)
        else one
        for one in selection.effects
    ]
    return Patch(in_order([*corrections.effects, *effects]), corrections.heavier)


def _bearable(comparison: Comparison, selection: Selection) -> list[Deviation]:
    """Deviations that make a mechanism together with the effects: friction lowered beside them could push at some speed."""
    kept: list[Deviation] = []
    for one in selection.deviations:
        try:
            comparison.simulation.dynamics(in_order([*as_effects(comparison, [*kept, one]), *selection.effects]))
        except UserError as error:
            logger.warning("%s on %s is left as the model has it: %s", one.effect, one.axis, error)
            continue
        kept.append(one)
    return kept


def together(one: Patch, other: Patch) -> Patch:
    """Both."""
    return Patch(in_order([*one.effects, *other.effects]), {**(one.heavier or {}), **(other.heavier or {})})


def patch_of_deviations(comparison: Comparison, found: Sequence[Deviation]) -> Patch:
    """Parameters that were found off, as what corrects them."""
    members = [member for one in found for member in one.members]
    heavier = {one.nominal.body: one.amount for one in members if one.nominal.body is not None}
    return Patch(tuple(as_effects(comparison, found)), heavier)


def _told(one: Off, comparison: Comparison) -> tuple[float, str, str]:
    """Value, name and unit of the parameter that a deviation gives."""
    nominal = one.nominal
    if nominal.effect is None or nominal.axis is None:
        name = comparison.simulation.model.body(nominal.body).name or f"body {nominal.body}"
        return 1.0 + one.amount, f"mass_scale_{name}", "1"
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
