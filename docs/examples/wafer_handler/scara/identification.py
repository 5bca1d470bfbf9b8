"""From recordings of the arm to its base parameters and friction, all in one regression (the paper's Fig. 3, extended).

    tau = Y(q, q', q'') base + sum over axes [coulomb sgn(v) + viscous v + static_rise sgn(v) exp(-(|v|/vs)^e) + offset]

The axes share parameters (what couples rotate and stretch), so their rows are solved together, each axis weighted by the noise
of its own torque: Gautier, Dynamic identification of robots with power model, ICRA 1997; weights as in Swevers et al.,
IEEE Control Systems Magazine 27(5), 2007, eq. 14.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.identification.covariance import hac_covariance
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.least_squares import Solution, solve, told
from drivetwin.identification.regressors import Design, Label, Stribeck, Term, column
from drivetwin.identification.result import Parameter
from drivetwin.identification.settings import Settings
from drivetwin.motion.axis_motion import AxisMotion, axis_motions
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.motion.moving import AxisSamples, select, standstill, standstill_velocity
from drivetwin.recording.recording import Recording, Samples
from wafer_handler.scara.dynamics import PARAMETERS, BaseParameters, regressor
from wafer_handler.scara.geometry import JOINTS

AXES = JOINTS[:3]
"""lift, rotate, stretch: the axes that motors drive."""

SETTINGS = Settings(cutoff_hz=20.0, reversal_margin=0.05)
"""Far enough below where belts of such an arm ring (50 to 100 Hz) for its inertias to be those of a rigid one."""

ACROSS = ("forearm_moment_across", "blade_moment_across")

Pieces = list[list[AxisMotion]]


@dataclass(frozen=True)
class FrictionCurve:
    """Captured torque less rigid-body torque of one axis against its velocity: samples in motion (n,), joint side, SI."""

    velocity: Samples
    torque: Samples


@dataclass(frozen=True)
class BaseIdentification:
    """`parameters` by the names of BaseParameters, without those that nothing proves to differ from 0.

    By axis: the friction `laws`, their parameters, the measured `curves`, and |residual| / |torque| of the fit.
    """

    base: BaseParameters
    parameters: dict[str, Parameter]
    laws: dict[str, FrictionLaw]
    friction: dict[str, dict[str, Parameter]]
    curves: dict[str, FrictionCurve]
    relative_error: dict[str, float]


def identify_arm(
    model: Model, recordings: Sequence[Recording], laws: Mapping[str, FrictionLaw], settings: Settings = SETTINGS
) -> BaseIdentification:
    """Base parameters and friction of the arm from `recordings` of lift, rotate and stretch.

    `laws` give the shape of each axis's Stribeck curve (its velocity and exponent), found where the axes moved slowly; the
    torques are fitted anew. Raises UserError where an axis is not recorded, or never moves, and where the motion does not tell
    a parameter from the others, naming those and the motion that does.
    """
    pieces = [axis_motions(model, recording, settings.cutoff_hz) for recording in recordings]
    _refuse_missing(recordings, pieces)
    samples = _samples(pieces, settings)
    shapes = {axis: _shape(laws[axis]) for axis in AXES}
    design = _told(_design(pieces, samples, shapes))
    design = _without_symmetric(_weighted(design, solve(design)), settings)
    solution = solve(design)
    covariance = hac_covariance(design, design.matrix, solution.residual)
    half = covariance.quantile(settings.confidence)

    def parameter(label: Label, unit: str) -> Parameter:
        value = solution.value(label)
        error = half * covariance.standard_error(design.terms.index(label))
        return Parameter(value, unit, (value - error, value + error))

    base = BaseParameters(**{meaning.name: solution.value(meaning.name) for meaning in PARAMETERS})
    return BaseIdentification(
        base=base,
        parameters={entry.name: parameter(entry.name, entry.unit) for entry in PARAMETERS if entry.name in design.terms},
        laws={axis: _law(solution, axis, shapes[axis]) for axis in AXES},
        friction={
            axis: {term.value: parameter(_name(axis, term), _UNITS[axis][term]) for term in _terms(axis, shapes[axis])}
            for axis in AXES
        },
        curves={axis: _curve(pieces, samples, base, number) for number, axis in enumerate(AXES)},
        relative_error={axis: _relative_error(design, solution, number) for number, axis in enumerate(AXES)},
    )


_TURNING = {Term.COULOMB: "N·m", Term.VISCOUS: "N·m·s/rad", Term.STATIC_RISE: "N·m", Term.OFFSET: "N·m"}
_SLIDING = {Term.COULOMB: "N", Term.VISCOUS: "N·s/m", Term.STATIC_RISE: "N"}
_UNITS = {"lift": _SLIDING, "rotate": _TURNING, "stretch": _TURNING}


def _terms(axis: str, shape: Stribeck | None) -> list[Term]:
    """What friction of an axis is made of. The lift has no offset: its weight is a base parameter."""
    return [term for term in _UNITS[axis] if shape is not None or term is not Term.STATIC_RISE]


def _name(axis: str, term: Term) -> str:
    return f"{axis}.{term.value}"


def _shape(law: FrictionLaw) -> Stribeck | None:
    return None if law.stribeck_velocity is None else Stribeck(law.stribeck_velocity, law.stribeck_exponent)


def _samples(pieces: Pieces, settings: Settings) -> list[list[AxisSamples]]:
    """Which samples count: a list a recording, an entry an axis."""
    stands = []
    for number, axis in enumerate(AXES):
        motions = [piece[number] for piece in pieces]
        threshold = standstill_velocity(motions)
        if threshold is None:
            raise UserError(f"{axis} stands still in every recording: record a motion of it")
        stands.append(standstill(motions, threshold))
    margin = settings.reversal_margin
    return [[select(motion, where, margin) for motion, where in zip(piece, stands, strict=True)] for piece in pieces]


def _design(pieces: Pieces, samples: list[list[AxisSamples]], shapes: Mapping[str, Stribeck | None]) -> Design:
    """Rows of every axis of every recording below each other; `piece` counts recording and axis."""
    labels = [meaning.name for meaning in PARAMETERS]
    labels += [_name(axis, term) for axis in AXES for term in _terms(axis, shapes[axis])]
    matrices, targets, weights, numbers, seconds, blocks = [], [], [], [], [], []
    for index, (piece, counted) in enumerate(zip(pieces, samples, strict=True)):
        rigid = regressor(*_motion(piece))
        for number, (axis, motion, entry) in enumerate(zip(AXES, piece, counted, strict=True)):
            matrix = np.zeros((len(motion.time), len(labels)))
            matrix[:, : len(PARAMETERS)] = rigid[:, number]
            for term in _terms(axis, shapes[axis]):
                matrix[:, labels.index(_name(axis, term))] = column(motion, term, shapes[axis])
            matrices.append(matrix)
            targets.append(motion.torque)
            weights.append(entry.fitted * motion.period)
            numbers.append(np.full(len(motion.time), index * len(AXES) + number))
            seconds.append(np.arange(len(motion.time)) * motion.period)
            blocks.append(np.floor(seconds[-1] * motion.cutoff_hz + 1e-9).astype(np.int64))
    return Design(
        terms=tuple(labels),
        matrix=np.vstack(matrices),
        target=np.concatenate(targets),
        weight=np.concatenate(weights),
        piece=np.concatenate(numbers),
        seconds=np.concatenate(seconds),
        block=np.concatenate(blocks),
    )


def _motion(piece: Sequence[AxisMotion]) -> tuple[Samples, Samples, Samples]:
    """Joints, velocity, acceleration (n, 3) of a recording."""
    return (
        np.column_stack([motion.position for motion in piece]),
        np.column_stack([motion.velocity for motion in piece]),
        np.column_stack([motion.acceleration for motion in piece]),
    )


def _weighted(design: Design, solution: Solution) -> Design:
    """Each axis's rows divided by the variance of its residual: newtons and newton metres become comparable."""
    axis = design.piece % len(AXES)
    weight = design.weight.copy()
    for number in range(len(AXES)):
        rows = (axis == number) & (design.weight > 0.0)
        weight[axis == number] /= float(np.mean(solution.residual[rows] ** 2))
    return replace(design, weight=weight)


_FOLDED_AND_STRETCHED = "rotate accelerating with the arm folded and with it stretched"
_OVER_THE_TRAVEL = "stretch accelerating all over its travel"
_TOLD_BY = {
    "moving_mass": "lift moving both ways",
    "lift_armature": "lift accelerating",
    "rotate_inertia": _FOLDED_AND_STRETCHED,
    "blade_moment": _FOLDED_AND_STRETCHED,
    "stretch_inertia": _OVER_THE_TRAVEL,
    "forearm_moment": _OVER_THE_TRAVEL,
    "coupling_inertia": "rotate and stretch accelerating together",
} | {_name(axis, term): f"{axis} moving at several speeds both ways" for axis in AXES for term in _UNITS[axis]}
"""The motion that tells a parameter from the others; moments across are left out where nothing does."""


def _told(design: Design) -> Design:
    """The design without moments across that the motion does not tell. Raises UserError where it does not tell another one.

    No parameter stands both in the lift's rows and in others, so that newtons beside newton metres do no harm here.
    """
    moved = _moved(design)
    known = told(design.pick(moved))
    design = design.pick([label for label in design.terms if label in known or label not in ACROSS])
    known = told(design.pick([label for label in design.terms if label in moved]))
    by_motion: dict[str, list[str]] = {}
    for label in design.terms:
        if label not in known:
            by_motion.setdefault(_TOLD_BY[str(label)], []).append(str(label))
    if by_motion:
        untold = "; ".join(f"{', '.join(labels)} (told by {motion})" for motion, labels in by_motion.items())
        raise UserError(f"the recordings do not tell {untold}: record such motion as well, as capture_together does")
    return design


_RIPPLE = 0.02
"""Of rotate's acceleration: what a parameter [kg·m²] acts through has to be more than axes that hold give way."""


def _moved(design: Design) -> list[Label]:
    """The terms whose column is more than ripple."""
    norm = dict(zip(design.terms, np.linalg.norm(design.matrix * np.sqrt(design.weight)[:, None], axis=0), strict=True))
    turning = [meaning.name for meaning in PARAMETERS if meaning.unit == "kg·m²"]
    return [label for label in design.terms if label not in turning or norm[label] > _RIPPLE * norm["rotate_inertia"]]


def _without_symmetric(design: Design, settings: Settings) -> Design:
    """Bodies are symmetric to their links by the drawing: a moment across one stays only where the data prove it."""
    solution = solve(design)
    covariance = hac_covariance(design, design.matrix, solution.residual)
    unproven = [
        label
        for index, label in enumerate(design.terms)
        if label in ACROSS and covariance.p_value(solution.value(label), index) >= settings.significance
    ]
    return design.pick([label for label in design.terms if label not in unproven])


def _law(solution: Solution, axis: str, shape: Stribeck | None) -> FrictionLaw:
    law = FrictionLaw(
        coulomb=solution.value(_name(axis, Term.COULOMB)),
        viscous=solution.value(_name(axis, Term.VISCOUS)),
        offset=solution.value(_name(axis, Term.OFFSET)),
    )
    if shape is None:
        return law
    rise = solution.value(_name(axis, Term.STATIC_RISE))
    return replace(law, static_rise=rise, stribeck_velocity=shape.velocity, stribeck_exponent=shape.exponent)


def _curve(pieces: Pieces, samples: list[list[AxisSamples]], base: BaseParameters, axis: int) -> FrictionCurve:
    velocity, torque = [], []
    for piece, counted in zip(pieces, samples, strict=True):
        rigid = regressor(*_motion(piece))[:, axis] @ base.vector()
        rows = counted[axis].fitted
        velocity.append(piece[axis].velocity[rows])
        torque.append((piece[axis].torque - rigid)[rows])
    return FrictionCurve(np.concatenate(velocity), np.concatenate(torque))


def _relative_error(design: Design, solution: Solution, axis: int) -> float:
    """|measured - model| / |measured| over the fitted samples of one axis."""
    rows = (design.piece % len(AXES) == axis) & (design.weight > 0.0)
    return float(np.linalg.norm(solution.residual[rows]) / np.linalg.norm(design.target[rows]))


def _refuse_missing(recordings: Sequence[Recording], pieces: Pieces) -> None:
    for recording, piece in zip(recordings, pieces, strict=True):
        recorded = [motion.axis for motion in piece]
        if recorded != list(AXES):
            raise UserError(f"recording '{recording.name}' has axes {', '.join(recorded)}; expected {', '.join(AXES)}")
