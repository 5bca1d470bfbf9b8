"""Data flow: recordings -> filtered motion -> regression -> parameters with intervals and verdicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.identification.cross_validation import cross_validated_gain
from drivetwin.identification.delay import with_delay
from drivetwin.identification.excitation import speed_changes
from drivetwin.identification.fit import Fit, plain_fit, stribeck_fit
from drivetwin.identification.least_squares import identifiable, reweighted, solve
from drivetwin.identification.model_scale import with_model_scale
from drivetwin.identification.regressors import SYMMETRIC, Design, Term, build_design
from drivetwin.identification.residuals import error_if_moving, error_of_fit, traces_of
from drivetwin.identification.result import UNITS, AxisIdentification, Identification, Parameter, Test
from drivetwin.identification.settings import Settings
from drivetwin.identification.stribeck import Exponent, StribeckTest, find_stribeck
from drivetwin.identification.strokes import find_strokes
from drivetwin.motion.axis_motion import AxisMotion, axis_motions
from drivetwin.motion.inverse_dynamics import JointKind, Model
from drivetwin.motion.moving import AxisSamples, select, standstill, standstill_velocity
from drivetwin.recording.recording import Recording

_LEAST_MOTION = 0.25
_STANDS = "it stands still in every recording"
_WHY_NOT = {
    Term.COULOMB: "the axis hardly moves",
    Term.VISCOUS: "at one speed only, viscous and Coulomb friction cannot be distinguished: record another speed",
    Term.INERTIA: "the speed never changes within a recording: record a move that accelerates",
    Term.OFFSET: "the axis moves in one direction only, where an offset looks like Coulomb friction: record both",
}


def identify(
    model: Model,
    recordings: Sequence[Recording],
    validation: Sequence[Recording] = (),
    settings: Settings | None = None,
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Identify friction, inertia and offset of every axis that moves in `recordings`.

    Inverse dynamic identification model with least squares (IDIM-LS; Gautier 1997), errors on `validation` beside it.
    `progress` is told the name of each axis before it is fitted. Raises UserError if a joint is not in the model, a
    recording is too short or nothing moves.
    """
    chosen = settings or Settings()
    if not recordings:
        raise UserError("no recording to identify from: name at least one")
    trained = _by_axis([axis_motions(model, recording, chosen.cutoff_hz) for recording in recordings])
    checked = _by_axis([axis_motions(model, recording, chosen.cutoff_hz) for recording in validation])
    joints = {axis: info.joint for recording in recordings for axis, info in recording.info.axes.items()}
    axes: dict[str, AxisIdentification] = {}
    skipped: dict[str, str] = {}
    for axis, motions in trained.items():
        if progress:
            progress(axis)
        threshold = chosen.standstill_velocity.get(axis) or standstill_velocity(motions)
        stands = standstill(motions, threshold or np.inf)
        samples = [select(motion, stands, chosen.reversal_margin) for motion in motions] if threshold else []
        if threshold is None or _seconds(samples) < _LEAST_MOTION:
            skipped[axis] = _why_skipped(samples, chosen.reversal_margin)
            continue
        held = [select(motion, stands, chosen.reversal_margin) for motion in checked.get(axis, [])]
        joint = joints[axis]
        data = _AxisData(joint, model.kind(joint), model.inertia(joint), threshold, samples, held)
        axes[axis] = _identify_axis(data, chosen)
    if not axes:
        names = ", ".join(recording.name for recording in recordings)
        if not set(skipped.values()) <= {_STANDS}:
            raise UserError(
                f"--reversal-margin {chosen.reversal_margin:g}: all motion in {names} is within that time [s] of a "
                "reversal: give a smaller one"
            )
        raise UserError(
            f"nothing moves in {names}: at least {_LEAST_MOTION:g} s above the standstill velocity are needed; "
            "record a motion, or lower the threshold with --standstill"
        )
    return Identification(
        machine=recordings[0].info.machine,
        axes=axes,
        skipped=skipped,
        settings=chosen,
        lowered_cutoffs={
            motion.recording: motion.cutoff_hz
            for motions in (*trained.values(), *checked.values())
            for motion in motions
            if motion.cutoff_hz < chosen.cutoff_hz
        },
    )


@dataclass(frozen=True)
class _AxisData:
    """One axis: `inertia` of the model at qpos0 [kg·m² or kg], `threshold` of motion, what is fitted, what is held."""

    joint: str
    kind: JointKind
    inertia: float
    threshold: float
    samples: list[AxisSamples]
    held: list[AxisSamples]


def _identify_axis(data: _AxisData, settings: Settings) -> AxisIdentification:
    """All fits, tests and errors of one axis."""
    samples, held = data.samples, data.held
    design, unidentifiable, offered = _usable_design(samples, data.inertia, settings)
    stribeck = find_stribeck(design, samples, settings)
    fewer = [term for term in design.terms if term is not Term.VISCOUS_DIFFERENCE]
    symmetric = _fit(design.pick(fewer), samples, stribeck)
    directional = _fit(design, samples, stribeck) if Term.VISCOUS_DIFFERENCE in design.terms else None
    parameters = _parameters(symmetric, data.kind, settings)
    if symmetric.exponent and not symmetric.exponent.told:
        unidentifiable["stribeck_exponent"] = _exponent_untold(symmetric.exponent, settings)
    traces = traces_of(samples, symmetric, offered, False)
    held_traces = traces_of(held, symmetric, offered, True)
    directional_error = held_directional_error = None
    if directional:
        parameters |= _directional_parameters(directional, data.kind, settings.confidence)
        directional_error = error_of_fit(traces_of(samples, directional, offered, False))
        held_directional_error = error_if_moving(traces_of(held, directional, offered, True))
    law = symmetric.law()
    return AxisIdentification(
        axis=samples[0].motion.axis,
        joint=data.joint,
        kind=data.kind,
        parameters=parameters,
        unidentifiable=unidentifiable,
        relative_error=error_of_fit(traces),
        relative_error_directional=directional_error,
        validation_relative_error=error_if_moving(held_traces),
        validation_relative_error_directional=held_directional_error,
        direction=_direction_test(directional, settings) if directional else None,
        stribeck=_stribeck_verdict(stribeck, settings),
        minimum_velocity=law.minimum_velocity(_top_speed(samples)),
        standstill_velocity=data.threshold,
        law=law,
        directional_law=directional.law() if directional else None,
        strokes=find_strokes(samples, offered, symmetric.solution),
        traces=(*traces, *held_traces),
    )


def _usable_design(samples: Sequence[AxisSamples], inertia: float, settings: Settings) -> tuple[Design, dict[str, str], float]:
    """The regression with the terms that the data can tell, and why the others are missing.

    The third result is the inertia [kg·m² or kg] that was taken off the model's torque to be fitted: zero where the
    data cannot tell it, for then the model's own stays.
    """
    wanted = (*SYMMETRIC, Term.VISCOUS_DIFFERENCE)
    excited = speed_changes(samples)
    offered = inertia if excited else 0.0
    design = build_design(samples, [term for term in wanted if excited or term is not Term.INERTIA], offered)
    kept = _told(design, wanted)
    if excited and Term.INERTIA not in kept:
        offered = 0.0
        design = build_design(samples, kept, offered)
    if Term.OFFSET not in kept:
        kept = tuple(term for term in kept if term is not Term.VISCOUS_DIFFERENCE)
    missing = {term.value: _WHY_NOT[term] for term in SYMMETRIC if term not in kept}
    design = design.pick(kept)
    design = reweighted(design, solve(design).residual)
    if Term.INERTIA in kept:
        design = with_model_scale(design, samples, offered)
    if settings.estimate_delay and Term.INERTIA in kept:
        design = with_delay(design, samples)
    return design, missing, offered


def _told(design: Design, terms: Sequence[Term]) -> tuple[Term, ...]:
    """Those of `terms` that the data tell."""
    told = identifiable(design)
    return tuple(term for term in terms if term in told)


def _fit(design: Design, samples: Sequence[AxisSamples], found: StribeckTest) -> Fit:
    """With the Stribeck term where it is real."""
    if found.real and found.stribeck and found.exponent:
        return stribeck_fit(design, samples, found.stribeck, found.exponent)
    return plain_fit(design)


def _parameters(fit: Fit, kind: JointKind, settings: Settings) -> dict[str, Parameter]:
    """The parameters of the symmetric law, in the contract's order."""
    units, confidence = UNITS[kind], settings.confidence
    unit = {Term.INERTIA: units.inertia, Term.VISCOUS: units.viscous}
    order = (Term.INERTIA, Term.COULOMB, Term.VISCOUS, Term.OFFSET)
    found = {
        term.value: fit.combination({term: 1.0}, unit.get(term, units.torque), confidence)
        for term in order
        if term in fit.design.terms
    }
    if Term.MODEL_SCALE in fit.design.terms:
        found["model_scale"] = fit.combination({Term.MODEL_SCALE: 1.0}, "1", confidence).moved(1.0)
    if Term.DELAY in fit.design.terms:
        found["delay"] = fit.combination({Term.DELAY: 1.0}, "s", confidence)
    if fit.stribeck:
        static = {Term.COULOMB: 1.0, Term.STATIC_RISE: 1.0}
        found["static_torque"] = fit.combination(static, units.torque, confidence)
        found["stribeck_velocity"] = fit.stribeck_velocity(units.velocity, confidence)
    if fit.exponent and fit.exponent.told:
        found["stribeck_exponent"] = fit.stribeck_exponent(settings.stribeck_exponent_bounds, confidence)
    return found


def _exponent_untold(exponent: Exponent, settings: Settings) -> str:
    (low, high), (least, most) = exponent.interval, settings.stribeck_exponent_bounds
    return (
        f"the data only show that it is {low:.2g} to {high:.2g}, of {least:g} to {most:g} searched, so "
        f"{settings.stribeck_exponent:g} is kept, and the intervals of the other parameters allow for that: record more "
        "strokes at low speeds"
    )


def _directional_parameters(fit: Fit, kind: JointKind, confidence: float) -> dict[str, Parameter]:
    """The parameters of the direction-dependent law, which holds the offset as a difference of the Coulomb torques.

    coulomb_positive/negative = coulomb +/- offset, viscous_positive/negative = viscous +/- viscous_difference.
    """
    torque, viscous = UNITS[kind].torque, UNITS[kind].viscous
    found = {}
    for name, sign in (("positive", 1.0), ("negative", -1.0)):
        coulomb = {Term.COULOMB: 1.0, Term.OFFSET: sign}
        found[f"coulomb_{name}"] = fit.combination(coulomb, torque, confidence)
    for name, sign in (("positive", 1.0), ("negative", -1.0)):
        slope = {Term.VISCOUS: 1.0, Term.VISCOUS_DIFFERENCE: sign}
        found[f"viscous_{name}"] = fit.combination(slope, viscous, confidence)
    return found


def _direction_test(fit: Fit, settings: Settings) -> Test:
    """Is friction really different by direction, beyond what an offset explains?

    The direction-dependent law is the symmetric law with offset plus viscous_difference |v|; the test is on that term.
    """
    index = fit.design.terms.index(Term.VISCOUS_DIFFERENCE)
    value = fit.solution.value(Term.VISCOUS_DIFFERENCE)
    p_value = fit.covariance.p_value(value, index)
    gain = cross_validated_gain(fit.design, [term for term in fit.design.terms if term is not Term.VISCOUS_DIFFERENCE])
    real = p_value < settings.significance and gain >= settings.direction_gain
    offset = fit.combination({Term.OFFSET: 1.0}, "", settings.confidence)
    load = (
        "The Coulomb torques of this fit differ, which is equivalent to an offset: a load, or gravity that the model lacks"
        if offset.interval[0] * offset.interval[1] > 0
        else "The Coulomb torques of this fit do not differ"
    )
    verdict = (
        "friction depends on the direction: the viscous coefficients differ significantly"
        if real
        else "no evidence that friction depends on the direction: one viscous coefficient fits both"
    )
    return Test(
        real=real,
        name="Wald test of viscous_positive = viscous_negative, HAC covariance",
        statistic=value / fit.covariance.standard_error(index),
        p_value=p_value,
        gain=gain,
        note=f"{verdict}. {load}.",
    )


def _stribeck_verdict(found: StribeckTest, settings: Settings) -> Test:
    """The Stribeck test in words."""
    note = (
        "friction rises towards low speed: coulomb and viscous are those of the law with the Stribeck term"
        if found.real
        else "no rise of friction towards low speed that pays: the law is Coulomb and viscous friction alone "
        f"(a Stribeck term needs a positive rise, p < {settings.significance:g} and {settings.stribeck_gain:.0%} gain)"
    )
    name = (
        f"t-test of static_torque = coulomb at the best of {found.trials} trial shapes (velocity, exponent), HAC "
        "covariance, p-value times the number of trials (Bonferroni); gain with the shape chosen anew without each fold"
    )
    return Test(found.real, name, found.statistic, found.p_value, found.gain, note)


def _by_axis(recordings: Sequence[Sequence[AxisMotion]]) -> dict[str, list[AxisMotion]]:
    """The motions of each axis, in order of recording."""
    axes: dict[str, list[AxisMotion]] = {}
    for motions in recordings:
        for motion in motions:
            axes.setdefault(motion.axis, []).append(motion)
    return axes


def _why_skipped(samples: Sequence[AxisSamples], margin: float) -> str:
    """Why nothing is left to fit: the axis stands, or moves only within the `margin` [s] of its reversals."""
    around = sum(entry.motion.period * float((entry.moving & ~entry.fitted).sum()) for entry in samples)
    if margin > 0.0 and around >= _LEAST_MOTION:
        return f"it moves only within {margin:g} s of a reversal"
    return _STANDS


def _seconds(samples: Sequence[AxisSamples]) -> float:
    """Time that counts in the fit [s]."""
    return sum(entry.motion.period * float(entry.fitted.sum()) for entry in samples)


def _top_speed(samples: Sequence[AxisSamples]) -> float:
    """Greatest speed in motion [rad/s or m/s]."""
    return max(float(np.abs(entry.motion.velocity[entry.moving]).max(initial=0.0)) for entry in samples)
