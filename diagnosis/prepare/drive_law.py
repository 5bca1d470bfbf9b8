"""What a drive's loops ask for, from the recorded demand and the recorded motion: the torque that the motor should have given.

The recorded position is what the loops themselves saw, so nothing of the plant is in it: a torque that differs from what was
asked tells of the drive alone. The cascade is that of CiA 402-2 with a PI velocity loop, the PID that of a following error
(facts of the recording's `drive`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import exp, pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.run import Run
from drivetwin.emulator.drive.servo import Loop
from drivetwin.emulator.dynamics.sampling import Answer
from drivetwin.emulator.effects import DriveEffect, library
from drivetwin.emulator.effects.current_bandwidth import CurrentBandwidth
from drivetwin.foundation.compiled import compiled
from drivetwin.foundation.errors import UserError
from drivetwin.motion.filtering import derivative
from drivetwin.recording.recording import AxisInfo, DriveLoops
from drivetwin.twin.loops import Loops, told_loops

Array = NDArray[np.float64]

LAW_HOLDS = 0.05
"""Share of the torque's rms, within which the law has to give the recorded torque in the median."""

FAR = 0.5
"""The same share, beyond which the loops are none of this drive. Waves faster than the samples make the law miss much of it."""

Missing = tuple[str, str]
"""What is missing, and what would be needed."""

NOT_RECORDED: Missing = ("the drive's demand and loops are not recorded", "`position_demand`, and `drive` with its gains")
OTHER_LAW: Missing = (
    "the recorded demand and loops do not give the recorded torque",
    "in `drive`, the law and the gains that the drive has",
)

FIRST = 0.2
"""Of a recording [s], whose torque says what the integral held before it: one sample carries its full noise."""
FEWEST = 20
"""Rows of a recording that are worth a comparison."""


@dataclass(frozen=True)
class Asked:
    """Torque asked before (`fast`) and after the commissioned lag of the current loop (`lagged`), and given; each (n,)."""

    fast: Array
    lagged: Array
    given: Array


def asked_of(run: Run, axis: str) -> Asked | None:
    """None where the recording does not tell the demand or the loops."""
    info, columns = run.recording.info.axes[axis], run.recording.columns[axis]
    drive = info.drive
    if drive is None or "position_demand" not in columns or "position" not in columns:
        return None
    loops = _loops(drive)
    if loops is None:
        return None
    demand, position = columns["position_demand"], columns["position"]
    given = run.axes[axis].motion.torque  # read earlier by what its channel is late: the rest is the current loop's
    if not np.isfinite(demand).all():
        return None
    followed = partial(
        _followed,
        demand,
        loops.velocity_feedforward * derivative(demand, run.period) + _or_zero(columns.get("velocity_offset"), len(demand)),
        _or_zero(columns.get("torque_offset"), len(demand)),
        *_speed_as_seen(position, drive, run.period),
        position,
        np.array(
            [
                loops.position_gain,
                loops.velocity_gain,
                loops.integral_rate,
                loops.position_stiffness,
                loops.position_integral,
                loops.torque_limit,
                run.period,
            ]
        ),
    )
    fast = _from_its_start(followed, given, max(1, round(FIRST / run.period)))
    return Asked(fast, lagged(fast, loops.current_time_constant, run.period), given)


def _from_its_start(followed: Callable[[float], Array], given: Array, first: int) -> Array:
    """Torque asked (n,), of what the integral may have held the one that is nearer to the torque given: what the first sample
    says, or the median of the `first` ones, in which a motor at its limit gives less.
    """
    one = followed(float(given[0]))
    several = followed(float(one[0] + np.median(given[:first] - one[:first])))
    return min(one, several, key=lambda asked: float(np.median(np.abs(given - asked))))


def answer_of(info: AxisInfo, inertia: Array) -> Answer | None:
    """What the recorded loops give against a torque, of the middle of an inertia (n,) [kg·m² or kg]; None if none are told."""
    loops = None if info.drive is None else _loops(info.drive)
    return None if loops is None else partial(loops.answer, inertia=float(np.median(inertia)))


def _loops(drive: DriveLoops) -> Loops | None:
    """The loops that follow a demand of the position, where all their gains are told."""
    try:
        loops = told_loops("drive", drive)
    except UserError:
        return None
    return loops if loops is not None and loops.loop is Loop.POSITION else None


def law_missing(runs: Sequence[Run], axis: str) -> Missing | None:
    """Why it is not known what the drive asked for; None where the recorded loops and demand give the recorded torque in the
    median sample, as they are or with one effect.

    Where the drive has an effect of its own, the law without it holds nowhere: a slow current loop is late everywhere.
    """
    told = [(run, asked_of(run, axis)) for run in runs if run.axes[axis].used.any()]
    known = [(run, asked) for run, asked in told if asked is not None]
    if len(known) < len(told):
        return next(_missing(run, axis) for run, asked in told if asked is None)
    if not known:
        return NOT_RECORDED
    tried: list[tuple[DriveEffect, ...]] = [(), *((effect,) for effect in drive_candidates(known))]
    return None if any(law_holds(known, axis, effects) for effects in tried) else OTHER_LAW


def known_laws(runs: Sequence[Run], axis: str) -> list[tuple[Run, Asked]]:
    """Runs in which an axis moves whose law is told, with what that asked for."""
    return [(run, asked) for run in runs if run.axes[axis].used.any() and (asked := asked_of(run, axis)) is not None]


def law_is_far(runs: Sequence[Run], axis: str) -> bool:
    """Whether the recorded loops and demand give another torque than the recorded one: gains of another unit, say."""
    known = known_laws(runs, axis)
    return bool(known) and not law_holds(known, axis, (), FAR)


def law_holds(known: Sequence[tuple[Run, Asked]], axis: str, effects: Sequence[DriveEffect], share: float = LAW_HOLDS) -> bool:
    """Whether the law and effects, as they are, give the recorded torque in the median sample, to a share of its rms."""
    pairs = [(run, asked, run.axes[axis].used) for run, asked in known]
    errors = [run.smooth(asked.given - given_with(asked, effects, run.period))[used] for run, asked, used in pairs]
    torque = np.concatenate([run.axes[axis].torque[used] for run, _, used in pairs])
    return float(np.median(np.abs(np.concatenate(errors)))) <= share * float(np.sqrt(np.mean(torque**2)))


def _missing(run: Run, axis: str) -> Missing:
    """Why a recording does not tell what the drive asked for."""
    drive, demand = run.recording.info.axes[axis].drive, run.recording.columns[axis].get("position_demand")
    holes = 0 if demand is None else int(np.sum(~np.isfinite(demand)))
    if holes and drive is not None and _loops(drive) is not None:
        return f"`position_demand` is no number in {holes} rows of {run.recording.name}", "a number in every row"
    return NOT_RECORDED


def drive_candidates(known: Sequence[tuple[Run, Asked]]) -> list[DriveEffect]:
    """Effects of every kind to try for what was asked and given."""
    kinds = [kind for kind in library().values() if issubclass(kind, DriveEffect)]
    return [
        effect
        for kind in kinds
        for run, asked in known
        for effect in kind.candidates(asked.lagged, run.smooth(asked.given), run.period)
    ]


def given_with(asked: Asked, effects: Sequence[DriveEffect], period: float) -> Array:
    """Torque that the law and effects give, the current loop first; a bandwidth takes the place of the commissioned lag."""
    slow = [effect for effect in effects if isinstance(effect, CurrentBandwidth)]
    torque = asked.fast if slow else asked.lagged
    for effect in (*slow, *(effect for effect in effects if effect not in slow)):
        torque = effect.respond(torque, period)
    return torque


def left_by(run: Run, axis: str, asked: Asked, effects: Sequence[DriveEffect]) -> Array:
    """Rows (N,) of given less predicted torque, less what timing and the integral's unknown state may be: 1, t, q, v, a."""
    own = run.axes[axis]
    pick = np.flatnonzero(own.used[:: run.stride]) * run.stride
    if len(pick) < FEWEST:
        return np.zeros(0)
    y = run.smooth(asked.given - given_with(asked, effects, run.period))[pick]
    motion = own.motion
    samples = (motion.time, motion.position, motion.velocity, motion.acceleration)
    free = np.column_stack([np.ones(len(y)), *(values[pick] for values in samples)])
    free = (free - free.mean(axis=0) * (np.arange(5) > 0)) / np.maximum(np.abs(free).max(axis=0), 1e-12)
    return np.asarray(y - free @ np.linalg.lstsq(free, y, rcond=None)[0])


def lagged(torque: Array, time_constant: float, period: float) -> Array:
    """First-order lag."""
    if time_constant <= 0.0:
        return torque
    return np.asarray(_lag(torque, 1.0 - exp(-period / time_constant)))


def _speed_as_seen(position: Array, drive: DriveLoops, period: float) -> tuple[Array, float]:
    """Speed (n,) before the drive's filter, and the share of a new value that the filter takes at the recording's period [s].

    A servo at the recording's rate differentiates backwards. A faster one is late by half of its own period and by its
    filter: a central difference is not late, and a lag of both together follows it.
    """
    servo = drive.servo_period or 0.0
    lag = 1.0 / (2.0 * pi * drive.velocity_filter_hz) if drive.velocity_filter_hz else 0.0
    if servo > 0.5 * period:
        backwards = np.diff(position, prepend=position[0]) / period
        return backwards, 1.0 - exp(-period / lag) if lag else 1.0
    return derivative(position, period), period / (period + lag + 0.5 * servo)


def _or_zero(samples: Array | None, count: int) -> Array:
    return np.nan_to_num(samples) if samples is not None else np.zeros(count)


@compiled
def _followed(demand, speed, offset, measured_speed, share, position, loops, before):  # type: ignore[no-untyped-def]
    position_gain, velocity_gain, rate, stiffness, position_integral, limit, period = loops
    asked = np.empty(len(demand))
    velocity = 0.0
    integral = 0.0
    for k in range(len(demand)):
        velocity += share * (measured_speed[k] - velocity)
        following_error = demand[k] - position[k]
        error = position_gain * following_error + speed[k] - velocity
        direct = velocity_gain * error + stiffness * following_error + offset[k]
        if k == 0:
            integral = before - direct
        wanted = direct + integral
        if -limit < wanted < limit:
            integral += (velocity_gain * rate * error + position_integral * following_error) * period
        asked[k] = min(max(wanted, -limit), limit)
    return asked


@compiled
def _lag(torque, share):  # type: ignore[no-untyped-def]
    out = np.empty(len(torque))
    value = torque[0]
    for k in range(len(torque)):
        value += share * (torque[k] - value)
        out[k] = value
    return out
