"""What the recordings can be asked: each effect says what it needs of a motion; what is missing is told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.asked_torque import AskedTorque
from drivetwin.diagnosis.prepare.drive_law import Missing
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.emulator.effects import AxisEffect, DriveEffect, Effect, ModelEffect, Need, library
from drivetwin.emulator.effects.transmission_effect import TransmissionEffect
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]

LEAST_EACH_WAY = 0.03
"""Share of the time in motion, below which an axis does not count as moving that way."""
SPEED_RANGE = 1.5
"""Ratio of the 95th to the 5th percentile of the speed, below which all motion is at one speed."""
LEAST_INERTIAL = 0.02
"""Share of the torque that accelerations must make up."""
LEAST_REVERSALS = 2
LEAST_WAY = 0.01
"""Of the longest travel, below which an axis counts as standing in a recording."""
LEVEL, PLUMB = 0.02, 0.9998
"""Cosines: of a slide's angle to gravity below which it is level, of a hinge's above which it is plumb."""
LEAST_TIME = 20.0
"""That a slow drift needs, in one recording or from one to another [s]."""

WHY: Mapping[Need, tuple[str, str]] = {
    Need.BOTH_DIRECTIONS: ("motion in one direction only", "the same strokes in the other direction"),
    Need.TWO_SPEEDS: ("all motion at one speed", "strokes at several speeds, from a tenth of the highest on"),
    Need.REVERSALS: ("no reversal of the motion", "strokes forth and back"),
    Need.ACCELERATION: ("hardly any accelerations", "short moves of several accelerations"),
    Need.ABSOLUTE_POSITION: (
        "the position is relative to where each recording began",
        "an absolute position, or one recording",
    ),
    Need.MOTOR_ANGLE: (
        "the position is relative to where each recording began, and no wave of the torque tells the motor's angle",
        "an absolute position, one recording, or two motor turns in each",
    ),
    Need.WEIGHT: ("gravity does not act along this axis in the model", "the machine's gravity in the model, if it does act"),
    Need.TIME: (
        "too short, or the time since the machine was switched on is unknown",
        "`start_time` in recording.json, a `temperature` column, or longer",
    ),
}

SETS_APART = frozenset({Need.BOTH_DIRECTIONS, Need.TWO_SPEEDS})
"""Without these the torque of an effect is known, but is that of another effect as well."""

GIVEN_UNKNOWN = "no torque was recorded: the demanded torque does not show what the drive delivered"
AT_REST = ("the axis does not move in the recordings that are fitted", "a recording in which it moves")


@dataclass(frozen=True)
class NotTestable:
    """An effect that the recordings cannot answer for an axis, why, and what would be needed."""

    effect: str
    reason: str
    needed: str


@dataclass(frozen=True)
class Testable:
    """Effects that an axis can be asked for, those that it cannot, and by name those that the model speaks against.

    `veiled`: effects that cannot be asked for only because nothing sets them apart from others: what is named may be one.
    """

    __test__ = False

    kinds: tuple[type[Effect], ...]
    not_testable: tuple[NotTestable, ...]
    askew: frozenset[str]
    veiled: tuple[type[Effect], ...]


def testable(
    rows: Rows,
    axis: str,
    absolute: bool,
    turned: bool,
    lawless: Missing | None,
    asked: AskedTorque | None,
    dated: bool,
) -> Testable:
    """`absolute`: the position means the same in all recordings; `turned`: within a turn of the motor it does; `dated`: the
    times of all recordings count from one start.

    `lawless`: why it is not known what the drive asked for; `asked`: how the torque is known that was not recorded.
    """
    met = _met(rows, axis, absolute, turned, lawless is None, dated)
    why = WHY if lawless is None else {**WHY, Need.DEMAND: lawless}
    shown = rows.deflects(axis)  # a second encoder shows flanks that change without a reversal
    kinds, refused, veiled = [], [], []
    hidden = _hidden(asked)
    for kind in library().values():
        if not issubclass(kind, (AxisEffect, ModelEffect, DriveEffect)):
            continue
        needs = kind.needs - {Need.REVERSALS} if shown and issubclass(kind, TransmissionEffect) else kind.needs
        lacking = [need for need in Need if need in needs and need not in met]
        if not rows.count(axis):
            refused.append(NotTestable(kind.name, *AT_REST))
        elif kind.name in hidden:
            refused.append(NotTestable(kind.name, hidden[kind.name], "the torque that the drive gives: `torque`"))
        elif lacking:
            refused.append(NotTestable(kind.name, *why[lacking[0]]))
            if SETS_APART.issuperset(lacking) and not issubclass(kind, DriveEffect):
                veiled.append(kind)
        else:
            kinds.append(kind)
    weights = [kind.name for kind in kinds if Need.WEIGHT in kind.needs]
    return Testable(tuple(kinds), tuple(refused), frozenset(weights if _stands_plumb(rows, axis) else ()), tuple(veiled))


def _hidden(asked: AskedTorque | None) -> dict[str, str]:
    """Effects that a torque which was not recorded does not tell, each with the reason."""
    if asked is None:
        return {}
    found = {kind.name: GIVEN_UNKNOWN for kind in library().values() if issubclass(kind, DriveEffect)}
    if asked.floats:
        found["torque_offset"] = "no torque was recorded, and the integral of the drive holds any constant one"
    if not asked.scale_told:
        found["torque_constant"] = "no torque was recorded, and the gains of the drive are those that the model has"
    return found


def _met(rows: Rows, axis: str, absolute: bool, turned: bool, drive_told: bool, dated: bool) -> frozenset[Need]:
    velocity = rows.rows(axis, lambda _, own: own.motion.velocity)
    if not len(velocity):
        return frozenset()
    speed = np.abs(velocity)
    forwards = float(np.mean(velocity > 0.0))
    inertial = rows.rows(
        axis, lambda run, own: run.felt(own, own.motion.inertia * own.motion.acceleration + own.motion.from_others)
    )
    met = {
        Need.BOTH_DIRECTIONS: min(forwards, 1.0 - forwards) >= LEAST_EACH_WAY,
        Need.TWO_SPEEDS: float(np.quantile(speed, 0.95)) >= SPEED_RANGE * float(np.quantile(speed, 0.05)),
        Need.REVERSALS: _reversals(rows, axis) >= LEAST_REVERSALS,
        Need.ACCELERATION: float(np.sqrt(np.mean(inertial**2))) >= LEAST_INERTIAL * rows.size[axis],
        Need.ABSOLUTE_POSITION: absolute,
        Need.MOTOR_ANGLE: absolute or turned,
        Need.WEIGHT: _could_feel_gravity(rows, axis),
        Need.TIME: dated or _time_told(rows.runs),
        Need.DEMAND: drive_told,
    }
    return frozenset(need for need, holds in met.items() if holds)


def _reversals(rows: Rows, axis: str) -> int:
    """Changes of direction from one sample that counts to the next, each faster than a standstill."""
    own = [(run, run.axes[axis]) for run in rows.runs]
    signs = [np.sign(run.smooth(each.motion.velocity)[each.used]) for run, each in own]
    return sum(int(np.sum(np.diff(sign) != 0.0)) for sign in signs)


def _could_feel_gravity(rows: Rows, axis: str) -> bool:
    """Along a slide that is not level, about any hinge, for a base may stand askew; not in a model without any gravity."""
    return bool(np.any(rows.simulation.model.opt.gravity)) and (
        not rows.simulation.slides(axis) or _gravity_along(rows, axis) > LEVEL
    )


def _stands_plumb(rows: Rows, axis: str) -> bool:
    """Whether an axis is a hinge along gravity, as the model stands at qpos0: no weight turns it."""
    return not rows.simulation.slides(axis) and _gravity_along(rows, axis) > PLUMB


def _gravity_along(rows: Rows, axis: str) -> float:
    """Cosine of the angle between the axis and gravity; 0 without gravity."""
    model = rows.simulation.model
    gravity = np.array(model.opt.gravity)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    along = data.joint(rows.simulation.drives[axis].joint).xaxis @ gravity
    return float(abs(along) / max(np.linalg.norm(gravity), 1e-300))


def _time_told(runs: Sequence[Run]) -> bool:
    """Within one recording time is told; from one to another only where each says when it began."""
    times = [next(iter(run.axes.values())).motion.time for run in runs]
    spans = [(float(time[0]), float(time[-1])) for time in times]
    longest = max(end - begin for begin, end in spans)
    told = len({begin for begin, _ in spans}) == len(spans)
    whole = max(end for _, end in spans) - min(begin for begin, _ in spans)
    return (whole if told else longest * (len(runs) == 1)) >= LEAST_TIME


def is_integrated(recording: Recording, axis: str) -> bool:
    """Whether the position of an axis is the integral of its velocity, which begins anywhere."""
    return f"{axis}.position" in recording.info.derived or "position" not in recording.columns[axis]


def is_absolute(runs: Sequence[Run], axis: str) -> bool:
    """Whether the axis's position means the same in all recordings.

    Not where it was integrated from velocity or said to be relative; nor where recordings begin at the same place while in full
    motion, as an integral that begins at 0 does and no encoder. A recording in which the axis stands, while others move, says
    nothing of that.
    """
    if len(runs) == 1:
        return True
    for run in runs:
        if is_integrated(run.recording, axis) or run.recording.info.axes[axis].position_relative:
            return False
    motions = [run.axes[axis].motion for run in runs]
    travel = max(float(np.ptp(motion.position)) for motion in motions)
    motions = [motion for motion in motions if np.ptp(motion.position) > LEAST_WAY * travel]
    if len(motions) < 2:
        return True
    begins = np.array([motion.position[0] for motion in motions])
    at_once = [abs(float(motion.velocity[0])) > 0.5 * float(np.median(np.abs(motion.velocity))) for motion in motions]
    return not (np.ptp(begins) < 0.02 * travel and sum(at_once) > 0.5 * len(motions))
