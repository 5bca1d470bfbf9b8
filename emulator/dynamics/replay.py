"""The motor torque of a measured motion: the motor moves as measured, and what it drives follows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, copysign, cos, inf, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.carried import carried
from drivetwin.emulator.dynamics.friction import BRISTLES, drag_bristles, level_at, slip_share
from drivetwin.emulator.dynamics.motion import Motion
from drivetwin.emulator.dynamics.transmission import Transmission
from drivetwin.foundation.compiled import compiled

_IMPLICIT = 0.52
"""Share of the new value in the theta rule: hardly more than a half, so that a spring too stiff to follow dies out."""
_LONGEST_STEP = 5e-4
_MOST_STEPS = 16
_STEPS_PER_RADIAN = 4.0
_STIFFEST = 1.0
"""Angle through which a link may swing on a flank in one step [rad]: off a stiffer one it would bounce farther than it came."""
_BEGINS = 1e-3
"""Of the highest speed, above which a motion begins in its middle: what hangs on the spring then is what was measured."""
_FIRST_SWING = 0.5
"""Of the joint on its spring [rad], over which the torque that was measured at first is taken for a line: a parabola follows
the noise.
"""
_FEWEST = 4
"""Samples of that line, at least."""
_FIRST_SWINGS = 2.0
"""Turns of the swing over which the measured torque says how the joint begins."""
_FLANKS = (0.0, -1.0, 1.0)
"""Where in its gap a load may lie that rests: what the first torque says best."""
_TAKEN_UP = 0.05
"""After a gap was taken up [s], the torque that says so."""


@dataclass(frozen=True)
class Followed:
    """What an axis does while its encoder reads what was measured, (n,) each: torque that its drive reports [joint side, N·m or
    N], acceleration of the joint as far as it is known [rad/s² or m/s²], and how far the joint is ahead of the reading, by the
    gear ratio [rad or m].
    """

    torque: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    ahead: NDArray[np.float64]


def followed(motion: Motion, axis: AxisDynamics) -> Followed:
    """What an axis costs with all its parts, from its load to its encoder; computed once while it is asked for again.

    A rigid gear of constant ratio: rigid_torque + friction. Else inverse dynamics of the motor, whose motion is measured, and
    forward dynamics of the joint behind it (two-mass system, Spong 1987). Coriolis torque is that at the motor, weight that at
    the joint, linear in how far it is ahead. Shared, not to be written to.
    """
    return Followed(*motion.kept_lately(axis, lambda same: _followed(same, axis)))


def motor_torque(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Torque (n,) that the drive of an axis reports on a measured motion; joint side, N·m or N."""
    return followed(motion, axis).torque


def _followed(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """The rows of `Followed`, (3, n).

    What a late encoder reads happened earlier; the other axes were read when they were there.
    """
    if axis == axis.mechanics:
        return _driven(carried(motion, axis), axis)
    truth = axis.encoder.truth(motion, axis.gear_ratio)
    there = followed(truth, axis.mechanics)
    current, joint = axis.by_current(there.torque, truth), truth.position + there.ahead
    acceleration = there.acceleration - axis.encoder.unknown(motion, truth, axis.gear_ratio)
    if axis.encoder.delay > 0.0:
        steps = _steps(truth, axis)
        own = axis.encoder.later(motion, current - motion.from_others - steps) + axis.encoder.later_steps(motion, steps)
        acceleration, joint = (axis.encoder.later(motion, each) for each in (acceleration, joint))
        current = own + motion.from_others
    return np.stack((axis.motor.reported(current), acceleration, joint - motion.position))


def _steps(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Dry friction that the motor bears directly (n,): a spring rounds the steps of the rest. Shared, not to be written to."""
    share = axis.transmission.motor_friction_share if axis.transmission.elastic else 1.0
    dry = axis.friction.scaled(share).dry
    return motion.kept_lately(dry, dry.resistance)


def _driven(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Torque of the motor's shaft, acceleration of the joint and how far it is ahead of its motor, (3, n)."""
    through = _through_a_spring if axis.transmission.elastic else _through_a_rigid_gear
    found = through(motion, axis)
    found[0] += motion.kept("rotor", lambda same: same.rotor_inertia * same.acceleration)
    return found


def _weight(motion: Motion) -> NDArray[np.float64]:
    """What the rigid machine needs beside its inertia, (n,); shared, not to be written to."""
    return motion.kept("weight", lambda same: same.rigid_torque - same.inertia * same.acceleration)


def _link(motion: Motion) -> NDArray[np.float64]:
    """Inertia behind the motor, (n,); shared, not to be written to."""
    return motion.kept("link", lambda same: same.inertia - same.rotor_inertia)


def _without_friction(motion: Motion) -> NDArray[np.float64]:
    """What a rigid gear without friction asks of the motor beside its own inertia, (n,); shared, not to be written to."""
    return motion.kept("without friction", lambda same: _weight(same) + _link(same) * same.acceleration)


def _at_rest(motion: Motion) -> NDArray[np.float64]:
    """Zeros (n,): how far a rigid gear lets the joint move ahead; shared, not to be written to."""
    return motion.kept("rigid", lambda same: np.zeros_like(same.position))


def _slope(motion: Motion) -> NDArray[np.float64]:
    """d weight / d position of the joint, (n,); shared, not to be written to."""
    return motion.kept("slope", lambda same: np.broadcast_to(same.weight_slope, same.position.shape).copy())


def _at_first(motion: Motion) -> NDArray[np.float64]:
    """Velocity with which a replay begins, and the middle inertia behind the motor, (2,)."""
    first = float(motion.velocity[0])
    begins = first if abs(first) > _BEGINS * np.max(np.abs(motion.velocity)) else 0.0
    return np.array([begins, np.median(_link(motion))])


def _hangs_at_first(passes: NDArray[np.float64], period: float, swing: float) -> tuple[float, float]:
    """Torque that passes the spring at first, as it was measured, and how it changes a second: a line over half a radian."""
    count = min(len(passes), max(_FEWEST, round(_FIRST_SWING / (swing * period)) + 1))
    level, slope = _line(passes[:count], period)
    return float(level), float(slope)


@compiled
def _line(samples, period):  # type: ignore[no-untyped-def]
    """Value at the first of samples (n,), at least two, and slope of their line of least squares."""
    middle = 0.5 * (samples.shape[0] - 1)
    mean = np.mean(samples)
    rises, spread = 0.0, 0.0
    for k in range(samples.shape[0]):
        rises += (k - middle) * (samples[k] - mean)
        spread += (k - middle) ** 2
    slope = rises / (spread * period)
    return mean - slope * middle * period, slope


def _through_a_rigid_gear(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Torque that the load asks of the motor, acceleration and deflection of the joint, (3, n): by virtual work."""
    if axis.transmission.error_amplitude == 0.0:
        return np.stack((_without_friction(motion) + axis.friction.resistance(motion), motion.acceleration, _at_rest(motion)))
    joint, ratio, known = _at_the_joint(motion, axis.transmission, axis.gear_ratio)
    link = _link(motion)
    ahead = joint.position - motion.position
    weight = _weight(motion) + motion.weight_slope * ahead
    torque = (weight + link * joint.acceleration + axis.friction.resistance(joint)) * ratio
    return np.stack((torque, known, ahead))


def _at_the_joint(
    motion: Motion, gear: Transmission, gear_ratio: float
) -> tuple[Motion, NDArray[np.float64], NDArray[np.float64]]:
    """How the joint moves on a rigid gear, q = m + e(m), m as measured; d joint / d motor on the way (n,), as a torque shows
    it; and the joint's acceleration (n,) as far as that is known, which other axes feel.
    """
    wave = gear.error_order * gear_ratio
    angle = wave * motion.position + gear.error_phase
    ratio = 1.0 + gear.error_amplitude * wave * np.cos(angle)
    position = motion.position + gear.error_amplitude * np.sin(angle)
    bend = gear.error_amplitude * wave**2 * motion.velocity**2
    velocity, along = ratio * motion.velocity, ratio * motion.acceleration
    acceleration, known = (along - bend * of(angle, wave) for of in (motion.wave, motion.known_wave))
    needed = motion.rigid_torque + _link(motion) * (acceleration - motion.acceleration)
    joint = replace(motion, position=position, velocity=velocity, acceleration=acceleration, rigid_torque=needed)
    return joint, 1.0 + gear.error_amplitude * wave * motion.wave(angle + 0.5 * pi, wave), known


def _through_a_spring(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """The same of a load on a spring, whose motor moves as measured and bears a share of the friction."""
    share = axis.transmission.motor_friction_share
    shaft = motion.kept("shaft", lambda same: same.torque - same.rotor_inertia * same.acceleration)
    varying = axis.friction.varying_level(motion)
    if share == 0.0:
        return _of_the_load(motion, axis, shaft, varying)
    held = share * motion.kept_lately(axis.friction, axis.friction.resistance)
    found = _of_the_load(motion, axis.behind_the_spring, shaft - held, (1.0 - share) * varying)
    found[0] += held
    return found


def _of_the_load(
    motion: Motion, axis: AxisDynamics, passes: NDArray[np.float64], varying: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The same behind the spring; `passes` (n,) is the torque that passes it, as measured, `varying` (n,) the part of the level
    of friction that load and position make: that of the load goes by the torque of the whole axis.
    """
    begins = _begins(motion, axis, passes, varying)
    if len(begins) == 1:
        return _swung(motion, axis, varying, *begins[0])
    few = varying[: max(_first_samples(motion, axis.transmission.gap), _first_swings(motion, axis))]
    missed = [float(np.sum((_swung(motion, axis, few, *each)[0] - passes[: len(few)]) ** 2)) for each in begins]
    return _swung(motion, axis, varying, *begins[int(np.argmin(np.nan_to_num(missed, nan=inf)))])


def _begins(
    motion: Motion, axis: AxisDynamics, passes: NDArray[np.float64], varying: NDArray[np.float64]
) -> list[tuple[float, float, float]]:
    """Ways in which a replay may begin: torque that passes the spring, how it grows a second, and the flank of the gap.

    In motion it is as measured, or as the first swings have it, on either flank of a gap. At rest the load may lie anywhere in
    a gap, and its spring may be wound up as far as friction holds; what no friction could hold is the weight, for a brake has
    the motor.
    """
    law, gear = axis.friction, axis.transmission
    velocity = float(motion.kept("at first", _at_first)[0])
    hangs, grows = _hangs_at_first(passes, motion.period, _swing(motion, axis))
    if velocity != 0.0:
        measured = hangs, grows, float(np.sign(hangs))
        flanks = (-1.0, 1.0) if gear.gap > 0.0 else (measured[2],)
        return [measured, *(_as_it_swings(motion, axis, passes, varying, hangs, grows, flank) for flank in flanks)]
    weight, level = float(_weight(motion)[0]), max(law.coulomb, law.static_torque) * float(law.warmth(motion)[0])
    if abs(hangs - weight) > level:
        hangs = weight if abs(weight) > level else 0.0
    wound = (hangs, 0.0, float(np.sign(hangs)))
    return [wound, *((0.0, 0.0, flank) for flank in _FLANKS)] if gear.gap > 0.0 and abs(weight) <= level else [wound]


def _as_it_swings(
    motion: Motion, axis: AxisDynamics, passes: NDArray[np.float64], varying: NDArray[np.float64],
    hangs: float, grows: float, flank: float,
) -> tuple[float, float, float]:  # fmt: skip
    """A way to begin in motion, corrected by what its first swings miss of the measured torque: a Gauss-Newton step.

    A link that hardly damps keeps for long what noise or a coarse torque made of its first samples: of an output error, initial
    conditions are estimated as well (Ljung, System Identification, 1999, sec. 3.2).
    """
    swing, count = _swing(motion, axis), _first_swings(motion, axis)
    size = float(np.ptp(passes[:count])) or 1.0

    def missed(more: float, faster: float) -> NDArray[np.float64]:
        begun = _swung(motion, axis, varying[:count], hangs + more, grows + swing * faster, flank)
        return np.asarray(passes[:count] - begun[0])

    here = missed(0.0, 0.0)
    slopes = np.column_stack([here - missed(size, 0.0), here - missed(0.0, size)]) / size
    if not np.isfinite(slopes).all():
        return hangs, grows, flank
    more, faster = (float(each) for each in np.linalg.lstsq(slopes, here)[0])
    return hangs + more, grows + swing * faster, flank


def _first_swings(motion: Motion, axis: AxisDynamics) -> int:
    """Samples of a motion's first swings of the joint."""
    turns = 2.0 * pi / (_swing(motion, axis) * motion.period)
    return min(len(motion.position), max(_FEWEST, ceil(_FIRST_SWINGS * turns)))


def _swing(motion: Motion, axis: AxisDynamics) -> float:
    """How fast the joint swings on its spring and the bristles of its friction while its motor is held [rad/s]."""
    middle = float(motion.kept("at first", _at_first)[1])
    return sqrt((axis.transmission.stiffness + axis.friction.presliding_stiffness) / middle)


def _first_samples(motion: Motion, gap: float) -> int:
    """Samples in which the motor first takes up a gap, wherever its load lies in it."""
    moved = np.abs(motion.position - motion.position[0]) > 2.0 * gap
    return min(len(moved), max(_FEWEST, int(np.argmax(moved)) + 1 if moved.any() else 0) + round(_TAKEN_UP / motion.period))


def _swung(
    motion: Motion, axis: AxisDynamics, varying: NDArray[np.float64], hangs: float, grows: float, flank: float
) -> NDArray[np.float64]:
    """As many samples of that as the `varying` level has, as it begins."""
    count = len(varying)
    law, gear = axis.friction, axis.transmission
    velocity, middle = (float(value) for value in motion.kept("at first", _at_first))
    radians = _swing(motion, axis) * motion.period
    steps = min(_MOST_STEPS, max(ceil(motion.period / _LONGEST_STEP), ceil(_STEPS_PER_RADIAN * radians)))
    stiffness = gear.stiffness
    if gear.gap > 0.0:
        stiffness = min(stiffness, middle * (_STIFFEST * steps / motion.period) ** 2)
    found, speed = np.empty((3, count)), np.empty(count)
    _follow(
        law.record,
        gear.record,
        stiffness,
        gear.error_order * axis.gear_ratio,
        motion.position[:count],
        motion.velocity[:count],
        velocity,
        hangs,
        grows,
        flank,
        _link(motion)[:count],
        _weight(motion)[:count],
        _slope(motion)[:count],
        law.warmth(motion)[:count],
        varying,
        motion.period,
        steps,
        found,
        speed,
    )
    return found


@compiled
def _uneven(gear, wave, motor):  # type: ignore[no-untyped-def]  # record arrays have no static type
    """Where an untwisted transmission would have the joint, and d joint / d motor there."""
    if gear.error_amplitude == 0.0:
        return motor, 1.0
    angle = wave * motor + gear.error_phase
    return motor + gear.error_amplitude * sin(angle), 1.0 + gear.error_amplitude * wave * cos(angle)


@compiled
def _viscous(law, v):  # type: ignore[no-untyped-def]
    speed = abs(v)
    direction = law.viscous_asymmetry if v > 0.0 else -law.viscous_asymmetry
    return law.viscous + direction + law.quadratic * speed + law.cubic * speed**2


@compiled
def _start(gear, stiffness, untwisted, v, hangs, grows, flank):  # type: ignore[no-untyped-def]
    """Position and speed of the joint at first, on a flank of the gap, by the torque that passes the spring and its damper.

    `v`: the motor's speed, by the ratio. Where the joint is in its swing depends on what was before.
    """
    untwists = grows / stiffness
    pulls = hangs - gear.damping * untwists
    return untwisted - pulls / stiffness - 0.5 * flank * gear.gap, v - untwists


@compiled
def _follow(  # type: ignore[no-untyped-def]
    law,
    gear,
    stiffness,
    wave,
    position,
    velocity,
    begins,
    hangs,
    grows,
    flank,
    link,
    weight,
    slope,
    warmth,
    varying,
    period,
    steps,
    found,
    moves,
) -> None:
    """What is `found` (3, n) of a link (n,) on a spring, and how it `moves` (n,); `wave` [rad a rad or m].

    Its weight (n,) is that where the motor is, with a `slope` (n,).
    """
    torque, place = found[0], found[2]
    h, part, half_gap, damping = period / steps, 1.0 / steps, 0.5 * gear.gap, gear.damping
    bristle, bristle_damping = law.presliding_stiffness / BRISTLES, law.presliding_damping / BRISTLES
    gives_way = stiffness * _IMPLICIT * h + damping
    untwisted, ratio = _uneven(gear, wave, position[0])
    q, v = _start(gear, stiffness, untwisted, ratio * begins, hangs, grows, flank)
    through = hangs
    torque[0], moves[0], place[0] = ratio * through, v, q
    anchors = np.full(BRISTLES, q)
    for k in range(position.shape[0] - 1):
        level = max(0.0, warmth[k] * (level_at(law, abs(v)) + varying[k]))
        viscous = warmth[k] * _viscous(law, v)
        constant = weight[k] + slope[k] * (q - position[k]) + warmth[k] * law.coulomb_asymmetry
        inert = link[k] / h
        sprung, free = 1.0 / (inert + _IMPLICIT * (gives_way + viscous)), 1.0 / (inert + _IMPLICIT * viscous)
        slips = slip_share(law, level) if bristle > 0.0 else 0.0
        start, way, bend = position[k], position[k + 1] - position[k], 0.5 * (velocity[k + 1] - velocity[k]) * period
        first, gains = velocity[k], velocity[k + 1] - velocity[k]
        for step in range(steps):
            share = (step + 1) * part
            untwisted, ratio = _uneven(gear, wave, start + share * way - share * (1.0 - share) * bend)
            ahead = q + h * v
            twist = untwisted - ahead
            against, holds = constant, level
            if bristle > 0.0:
                against, holds = constant + drag_bristles(anchors, slips, bristle, bristle_damping, ahead, v), 0.0
            force = inert * v + (1.0 - _IMPLICIT) * (through - viscous * v) - against
            pushes, faster = 0.0, 0.0
            touching = abs(twist) > half_gap or half_gap == 0.0
            if touching:
                flank = copysign(half_gap, twist)
                end = untwisted - flank
                given = stiffness * (end - q - h * (1.0 - _IMPLICIT) * v) + damping * ratio * (first + share * gains)
                faster = _speed_after(force + _IMPLICIT * given, holds, sprung)
                pushes = given - gives_way * faster
                touching = pushes * flank >= 0.0
            if not touching:
                faster, pushes = _speed_after(force, holds, free), 0.0
            q += h * (_IMPLICIT * faster + (1.0 - _IMPLICIT) * v)
            v, through = faster, pushes
        torque[k + 1] = ratio * through
        moves[k + 1], place[k + 1] = v, q
    _slopes(moves, period, found[1])
    for k in range(position.shape[0]):
        place[k] -= position[k]


@compiled
def _slopes(samples, period, slopes) -> None:  # type: ignore[no-untyped-def]
    """Central differences of samples (n,), one-sided at both ends."""
    last = samples.shape[0] - 1
    slopes[0], slopes[last] = (samples[1] - samples[0]) / period, (samples[last] - samples[last - 1]) / period
    for k in range(1, last):
        slopes[k] = (samples[k + 1] - samples[k - 1]) / (2.0 * period)


@compiled
def _speed_after(force, level, gives):  # type: ignore[no-untyped-def]
    """Speed after a step of the theta rule, from the force of all but friction; it sticks where friction can hold that.

    `gives`: speed by force, of what resists in a step.
    """
    return 0.0 if abs(force) <= level else (force - copysign(level, force)) * gives
