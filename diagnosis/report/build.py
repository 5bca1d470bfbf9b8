"""From the set of effects that was found to the report's values: what is added, the gap without and with it, its causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.unknown import by_quantity
from drivetwin.diagnosis.prepare.deflection import deflection_of
from drivetwin.diagnosis.prepare.noise import Noise
from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.propose.drives import LIKE_ONE, DriveFound
from drivetwin.diagnosis.propose.placing import alike, placed
from drivetwin.diagnosis.propose.search import ANGLES
from drivetwin.diagnosis.report.distinguish import sensor_that_tells, tell_apart
from drivetwin.diagnosis.report.divided import Divided, divided
from drivetwin.diagnosis.report.gap_test import NAME, Errs, GapFound, significance
from drivetwin.diagnosis.report.gaps import Gaps, gaps_of
from drivetwin.diagnosis.report.masses import corrected_masses
from drivetwin.diagnosis.report.patched_model import patched_xml
from drivetwin.diagnosis.report.patterns import patterns
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.diagnosis.report.residual import with_residual
from drivetwin.diagnosis.report.result import (
    NOISE,
    TWO_SIDED_90,
    UNKNOWN,
    AxisGap,
    Cause,
    Diagnosis,
    Estimate,
    Prediction,
    Share,
    Shrink,
    Unknown,
    Verdict,
)
from drivetwin.diagnosis.report.shrink import shrink
from drivetwin.diagnosis.report.where import above_noise, regimes
from drivetwin.diagnosis.report.worth import worth_a_name
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Answer
from drivetwin.diagnosis.weigh.refit import Refitted
from drivetwin.emulator.effects import DriveEffect, PlacedEffect
from drivetwin.emulator.effects.base import JOINT_ENCODER
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

LEAST_ALONE = 0.25
"""Probability of the unknown where nothing else is named: an axis with a gap has a cause."""
SHOWN = 0.02
"""Probability from which an effect that was not selected is named."""
PAIRS = 0.1
"""Of the samples that count, so many pairs that far apart tell how like each other they are."""
EXPLAINED, PARTLY = 0.1, 0.7
"""Shares of the gap above noise, up to which what is unknown leaves it explained, and partly explained."""


def build(
    ready: Prepared,
    values: Refitted,
    answers: Sequence[Answer],
    drives: Sequence[DriveFound],
    settings: Settings,
    tables: bool = False,
) -> Diagnosis:
    """The report's values; effects that motion that was not fitted does not need, or that act where there is no gap, are left
    out. The values are then those of what is left.

    `tables`: what has no name is tabled as well.
    """
    strong = [one for one in drives if _drive_matters(ready.rows, one, settings)]
    units = placed_drives(ready.rows, strong)
    values, patch = worth_a_name(ready, values, units, settings.least_share)
    gaps = gaps_of(ready, patch, settings)
    parts = {axis: divided(ready, gaps, axis, settings.seed) for axis in ready.simulation.axes}
    named = {axis for axis in ready.simulation.axes if _is_small_and_named(ready, gaps, axis, parts[axis], settings)}
    gaps = gaps.with_names(named)
    tests = {axis: _tested(ready, gaps, axis) for axis in ready.simulation.axes}
    open_axes = [axis for axis in ready.simulation.axes if tests[axis].significant]
    felt = [
        one
        for one in gaps.patch.effects
        if one.axis in open_axes or any(parts[axis].share_of(one) >= settings.least_share for axis in open_axes)
    ]
    kept = Patch(tuple(felt), gaps.patch.heavier if open_axes else None)
    if kept != gaps.patch:
        gaps = gaps_of(ready, kept, settings).with_names(named)
        parts = {axis: divided(ready, gaps, axis, settings.seed) for axis in ready.simulation.axes}
    axes = {axis: _axis(ready, gaps, axis, tests[axis], parts[axis]) for axis in ready.simulation.axes}
    weights = _weights(gaps, open_axes)
    causes = _causes(ready, values, answers, strong, gaps, weights, parts, settings)
    unknown = {axis: axes[axis].unknown.share for axis in open_axes if axes[axis].unknown.share > 0.0}
    residual, told = with_residual(ready, gaps, unknown, settings) if tables else ((), ())
    return Diagnosis(
        verdict=_verdict(axes),
        settings=settings,
        axes=axes,
        causes=tuple(causes),
        selected=gaps.patch.effects,
        after_rms={axis: gap_rms(gaps.unseen, axis, "after") for axis in ready.simulation.axes},
        predictions=tuple(gaps.unseen),
        model_xml=patched_xml(ready.simulation, gaps.patch.heavier or {}),
        held_back=ready.held_back,
        units={axis: "N" if ready.simulation.slides(axis) else "N·m" for axis in ready.simulation.axes},
        masses=corrected_masses(ready, gaps, values.spread, weights, parts, _instead_of_masses(answers), settings),
        notes=ready.notes,
        validation=tuple(run.recording for run in ready.checks),
        residual=residual,
        with_residual=told,
    )


def _is_small_and_named(ready: Prepared, gaps: Gaps, axis: str, parts: Divided, settings: Settings) -> bool:
    """Whether effects explain an axis's gap that is no larger than what a model is expected to miss."""
    told = 1.0 - parts.of(UNKNOWN) - parts.of(NOISE)
    explained = told >= settings.least_share and _unexplained(parts.shares) <= EXPLAINED
    return explained and not _tested(ready, gaps, axis).significant


def _tested(ready: Prepared, gaps: Gaps, axis: str) -> GapFound:
    """Whether an axis has a gap: more than a model is expected to miss; or where effects explain it, more than its misfit."""

    def errs(noise: Noise) -> Errs:
        return Errs(noise.rms, noise.misfit) if noise.is_named else Errs(noise.floor)

    return gaps.tested(axis, ready.cutoff_hz, errs)


def placed_drives(rows: Rows, drives: Sequence[DriveFound]) -> list[PlacedEffect]:
    """Effects of drives with their units."""
    return [placed(rows, one.axis, one.effect) for one in drives]


def _drive_matters(rows: Rows, one: DriveFound, settings: Settings) -> bool:
    """Whether the law gives the recorded torque better by more than chance and by more than the comparison errs by."""
    return one.gain > np.log(25.0) and one.without.mean - one.left.mean > (settings.model_error * rows.size[one.axis]) ** 2


def _axis(ready: Prepared, gaps: Gaps, axis: str, test: GapFound, parts: Divided) -> AxisGap:
    noise, speed = gaps.noise[axis], ready.standstill[axis]
    seen = [each.axes[axis] for each in gaps.unseen]
    still = np.concatenate([(each.measured - each.before)[np.abs(each.velocity) <= speed] for each in seen])
    used = np.concatenate([each.measured[each.used] for each in seen])
    moves = bool(np.isfinite(speed)) and any(each.used.any() for each in seen)
    significant = test.significant
    after = [_as_it_stands(each, axis) for each in gaps.unseen]
    unit = "N" if ready.simulation.slides(axis) else "N·m"
    return AxisGap(
        cutoff_hz=ready.cutoff_hz,
        standstill_velocity=speed,
        torque_rms=float(np.sqrt(np.mean(used**2))) if used.size else 0.0,
        gap_rms=gap_rms(gaps.unseen, axis),
        noise_rms=noise.rms,
        noise_found_by=noise.found_by,
        model_error_rms=noise.model_error,
        standstill_rms=float(np.sqrt(np.mean(still**2))) if still.size else 0.0,
        significant=significant,
        test=NAME,
        p_value=test.p_value,
        shares=parts.shares,
        where=regimes(gaps.unseen, axis, noise.floor, speed) if moves else (),
        where_after=regimes(after, axis, noise.floor, speed) if moves and above_noise(after, axis, noise.floor, speed) else (),
        patterns=patterns(gaps.unseen, axis, noise.floor, ready.cutoff_hz, unit) if significant and moves else (),
        unknown=_unknown(after, axis, parts.of(UNKNOWN), noise, ready.cutoff_hz, unit, moves and significant),
        not_testable=ready.testable[axis].not_testable,
    )


def _unknown(
    after: Sequence[Prediction], axis: str, share: float, noise: Noise, cutoff_hz: float, unit: str, told: bool
) -> Unknown:
    """What is left, what it goes with by the patterns of what is left, and how fast it varies."""
    if not told:
        return Unknown(share, (), 0.0)
    with_it = patterns(after, axis, noise.floor, cutoff_hz, unit)
    energies: dict[str, float] = {}
    for one in with_it:
        energies[one.over] = max(one.share, energies.get(one.over, 0.0))
    slow = regimes(after, axis, noise.floor, 0.0)
    low = sum(each.share for each in slow if each.regime in ("low_speed", "reversal", "presliding"))
    if low > 0.5:
        energies["velocity"] = low
    return Unknown(share, tuple(by_quantity(energies)), _correlation_time(after, axis))


def _correlation_time(after: Sequence[Prediction], axis: str) -> float:
    """Time until what is left is half like itself [s], the mean of the recordings by their energy."""
    times, energies = [], []
    for each in after:
        part = each.axes[axis]
        rows = np.where(part.used, part.measured - part.before, 0.0)
        energy = float(rows @ rows)
        if energy <= 0.0:
            continue
        pairs = _with_itself(part.used.astype(np.float64))
        told = pairs > PAIRS * pairs[0]
        likeness = _with_itself(rows)[told] / pairs[told] * pairs[0] / energy
        below = np.flatnonzero(told)[likeness < 0.5]
        times.append((int(below[0]) if below.size else len(rows)) * each.period)
        energies.append(energy)
    return float(np.average(times, weights=energies)) if times else 0.0


def _with_itself(rows: Array) -> Array:
    """Sum of products of rows (n,) with themselves, by how many samples later (n,)."""
    return np.fft.irfft(np.abs(np.fft.rfft(rows, 2 * len(rows))) ** 2)[: len(rows)]


def _causes(
    ready: Prepared,
    values: Refitted,
    answers: Sequence[Answer],
    drives: Sequence[DriveFound],
    gaps: Gaps,
    weights: Mapping[str, float],
    parts: Mapping[str, Divided],
    settings: Settings,
) -> list[Cause]:
    """Selected effects, what else may be there, and the unknown, of every axis that has a gap; most probable share first."""
    causes = []
    for number, one in enumerate(gaps.patch.effects):
        taken = {axis: weight * parts[axis].share_of(one) for axis, weight in weights.items()}
        if isinstance(one.effect, DriveEffect):
            drive = next(each for each in drives if each.axis == one.axis and type(each.effect) is type(one.effect))
            causes.append(_drive_cause(one, drive, sum(taken.values())))
        else:
            causes.append(_selected(ready, values, answers, gaps, number, taken, settings))
    causes.extend(_alternatives(answers, gaps.patch, weights, parts, settings))
    for axis in weights:
        repeats = _repeats(ready, gaps, axis)
        named = any(cause.axis == axis and cause.probability > LEAST_ALONE for cause in causes)
        share = weights[axis] * parts[axis].of(UNKNOWN)
        causes.append(_unknown_cause(gaps, axis, share, ready.cutoff_hz, repeats, named))
    return sorted(causes, key=lambda cause: -cause.probability * cause.share)


def _weights(gaps: Gaps, open_axes: Sequence[str]) -> dict[str, float]:
    """Of each axis's gap in that of all, energies over those of their torques: axes have different units and sizes."""
    energies = {}
    for axis in open_axes:
        torque = np.concatenate([each.axes[axis].measured[each.axes[axis].used] for each in gaps.unseen])
        energies[axis] = gap_rms(gaps.unseen, axis) ** 2 / max(float(np.mean(torque**2)) if torque.size else 0.0, 1e-300)
    whole = sum(energies.values())
    return {axis: energy / whole if whole > 0.0 else 1.0 / len(energies) for axis, energy in energies.items()}


def _selected(
    ready: Prepared,
    values: Refitted,
    answers: Sequence[Answer],
    gaps: Gaps,
    number: int,
    taken: Mapping[str, float],
    settings: Settings,
) -> Cause:
    """`taken`: what it takes of the gap of each axis that has one. How far it closes the gap is told of its own."""
    one = gaps.patch.effects[number]
    answer = next((each for each in answers if each.chosen is not None and alike(each.chosen, one)), None)
    alike_ones = ready.waves_alike(type(one.effect), one.axis)
    others = tuple(dict.fromkeys((*(answer.indistinguishable if answer is not None else ()), *alike_ones)))
    rest = Patch(tuple(each for each in gaps.patch.effects if each is not one), gaps.patch.heavier)
    return Cause(
        one.effect.name,
        one.axis,
        answer.probability if answer is not None else 1.0,
        sum(taken.values()),
        _estimates(ready, values, one),
        _closed(ready, gaps, rest, one.axis, settings),
        others,
        tell_apart(one.effect.name, others),
        sensor_that_tells((one.effect.name, *others), _sensors(ready, one.axis)) if others else "",
    )


def _sensors(ready: Prepared, axis: str) -> tuple[str, ...]:
    """What the axis has beside its motor's encoder and torque."""
    return (JOINT_ENCODER,) if deflection_of(axis) in ready.rows.compared else ()


def _estimates(ready: Prepared, values: Refitted, one: PlacedEffect) -> dict[str, Estimate]:
    """Parameters with 90 % intervals; an angle, which comes back after a turn, is at most half a turn to either side."""
    number = next(k for k, each in enumerate(values.effects) if each is one)
    told = {}
    for parameter in one.effect.parameters:
        deviation = values.deviations[number].get(parameter.name, 0.0)
        value = float(getattr(one.effect, parameter.name))
        half = TWO_SIDED_90 * deviation
        interval = max(value - half, parameter.low), min(value + half, parameter.high)
        if parameter.name in ANGLES:
            within = float(np.fmin(half, np.pi))
            interval = value - within, value + within
        elif not np.isfinite(deviation):
            interval = _anywhere(ready, one, parameter.name)
        told[parameter.name] = Estimate(value, one.units[parameter.name], interval)
    return told


def _anywhere(ready: Prepared, one: PlacedEffect, parameter: str) -> tuple[float, float]:
    """Where a parameter that nothing tells may be: within its bounds; without any it is a place, within the machine's reach."""
    reach = float(ready.simulation.model.stat.extent)
    dynamics = ready.simulation.dynamics()[one.axis]
    low, high = one.effect.bounds(ready.rows.motion[one.axis], dynamics)[parameter]
    return low if np.isfinite(low) else -reach, high if np.isfinite(high) else reach


def _closed(ready: Prepared, gaps: Gaps, rest: Patch, axis: str, settings: Settings) -> Shrink | None:
    """What an effect adds to all others."""
    try:
        before = [predict(ready.simulation, run, rest) for run in ready.checks]
    except UserError:  # no mechanism without it: viscous friction lowered below its asymmetry, say
        return None
    return shrink(before, gaps.unseen, axis, gaps.noise[axis].floor, settings.seed)


def _drive_cause(one: PlacedEffect, drive: DriveFound, share: float) -> Cause:
    """A drive's effect shrinks no gap of the measured motion, only that between what the loops asked for and were given."""
    value = float(getattr(one.effect, one.effect.parameters[0].name))
    name = one.effect.parameters[0].name
    half = TWO_SIDED_90 * value / np.sqrt(max(float(drive.left.rows.sum()) / LIKE_ONE, 1.0))
    probability = float(1.0 / (1.0 + np.exp(-min(drive.gain - np.log(25.0), 50.0))))
    estimate = Estimate(value, one.units[name], (value - half, value + half))
    return Cause(one.effect.name, one.axis, probability, share, {name: estimate}, None)


def _alternatives(
    answers: Sequence[Answer],
    patch: Patch,
    weights: Mapping[str, float],
    parts: Mapping[str, Divided],
    settings: Settings,
) -> list[Cause]:
    """Effects that were not selected and may be there all the same, once each; `weights` of each axis that has a gap.

    What may stand in a selected effect's place would take what that takes.
    """
    selected = {(one.effect.name, one.axis) for one in patch.effects}
    told: dict[tuple[str, str], Cause] = {}
    for answer in answers:
        for member in answer.members:
            one = member.proposal.effect
            key = (one.effect.name, one.axis)
            takes = {axis: member.proposal.taken.get(axis, 0.0) for axis in weights}
            if key in selected or max(takes.values(), default=0.0) < settings.least_share or member.weight < SHOWN:
                continue
            if member.proposal.only_listed:
                continue
            if answer.chosen is not None and not _is_in(answer.chosen, patch):
                continue
            if key not in told or told[key].probability < member.weight:
                share = sum(weight * float(np.clip(takes[axis], 0.0, 1.0)) for axis, weight in weights.items())
                if answer.chosen is not None and one.axis == answer.chosen.axis:
                    share = sum(weight * parts[axis].share_of(answer.chosen) for axis, weight in weights.items())
                told[key] = Cause(one.effect.name, one.axis, member.weight, share, {}, None)
    return list(told.values())


def _instead_of_masses(answers: Sequence[Answer]) -> dict[int, tuple[str, ...]]:
    """Names of the effects that the mass of each body may be, by number, most probable first."""
    found = {}
    for answer in answers:
        if answer.body is not None:
            likely = [one for one in answer.members if one.weight >= SHOWN and not one.proposal.only_listed]
            found[answer.body] = tuple(dict.fromkeys(one.proposal.effect.effect.name for one in likely))
    return found


def _repeats(ready: Prepared, gaps: Gaps, axis: str) -> float:
    """Share of what is left that goes with something, cross-validated: noise goes with nothing."""
    left = [_as_it_stands(each, axis) for each in gaps.unseen]
    unit = "N" if ready.simulation.slides(axis) else "N·m"
    return min(1.0, sum(one.share for one in patterns(left, axis, gaps.noise[axis].unasked, ready.cutoff_hz, unit)))


def _is_in(one: PlacedEffect, patch: Patch) -> bool:
    return any(alike(one, other) for other in patch.effects)


def _unknown_cause(gaps: Gaps, axis: str, share: float, cutoff_hz: float, repeats: float, named: bool) -> Cause:
    """What is left: how surely it is more than noise. Half of that is doubted of what does not repeat."""
    left = [_as_it_stands(each, axis) for each in gaps.unseen]
    p_value = significance(left, axis, Errs(gaps.noise[axis].unasked), cutoff_hz)
    probability = float(np.clip((1.0 - p_value) * (0.5 + 0.5 * repeats), 0.01, 0.99))
    return Cause(UNKNOWN, axis, probability if named else max(probability, LEAST_ALONE), share, {}, None)


def _as_it_stands(prediction: Prediction, axis: str) -> Prediction:
    """The patched simulation as if it were the one that is asked about."""
    found = prediction.axes[axis]
    return replace(prediction, axes={axis: replace(found, before=found.after)})


def _verdict(axes: Mapping[str, AxisGap]) -> Verdict:
    """By what is unknown of the gap above noise, on the axis on which that is most."""
    left = [_unexplained(gap.shares) for gap in axes.values() if gap.significant]
    if not left:
        return Verdict.NO_GAP
    worst = max(left)
    return Verdict.EXPLAINED if worst <= EXPLAINED else Verdict.PARTLY_EXPLAINED if worst <= PARTLY else Verdict.UNEXPLAINED


def _unexplained(shares: Sequence[Share]) -> float:
    """What is unknown of a gap above noise, by the gap's shares."""
    told = {one.of: one.share for one in shares if one.of in (UNKNOWN, NOISE)}
    return told.get(UNKNOWN, 0.0) / max(1.0 - told.get(NOISE, 0.0), 1e-9)
