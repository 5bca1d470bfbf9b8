"""A load behind a spring or play, forward in time while its motor moves as measured."""

from __future__ import annotations

from math import ceil, copysign, cos, inf, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.friction import BRISTLES, drag_bristles, level_at, slip_share
from drivetwin.emulator.dynamics.motion import Motion
from drivetwin.foundation.compiled import compiled

Array = NDArray[np.float64]

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
_PARALLEL = 1e-12
"""Of a slope, what another one leaves of it, below which the two say the same."""


def load_on_a_spring(motion: Motion, axis: AxisDynamics, passes: Array, varying: Array) -> Array:
    """Torque of the motor's shaft, acceleration of the joint and how far it is ahead of its motor, (3, n).

    `passes` (n,) is the torque that passes the spring, as measured, `varying` (n,) the part of the level of friction that load
    and position make: that of the load goes by the torque of the whole axis.
    """
    law, gear, period = axis.friction, axis.transmission, motion.period
    velocity, middle = (float(value) for value in motion.kept("at first", _at_first))
    swing = sqrt((gear.stiffness + law.presliding_stiffness) / middle)
    steps = min(_MOST_STEPS, max(ceil(period / _LONGEST_STEP), ceil(_STEPS_PER_RADIAN * swing * period)))
    stiffness = gear.stiffness
    if gear.gap > 0.0:
        stiffness = min(stiffness, middle * (_STIFFEST * steps / period) ** 2)
    warmth = law.warmth(motion)
    begins = _begins(motion, axis, passes, swing, float(warmth[0]))
    found, moves = np.empty((3, len(varying))), np.empty(len(varying))
    track = motion.kept("track", _track)
    load = (
        law.record,
        gear.record,
        stiffness,
        gear.error_order * axis.gear_ratio,
        track,
        warmth,
        varying,
        velocity,
        period,
        steps,
    )
    _replay(load, passes, begins, swing, found, moves)
    return found


def _at_first(motion: Motion) -> Array:
    """Velocity with which a replay begins, and the middle inertia behind the motor, (2,)."""
    first = float(motion.velocity[0])
    begins = first if abs(first) > _BEGINS * np.max(np.abs(motion.velocity)) else 0.0
    return np.array([begins, np.median(motion.link)])


def _track(motion: Motion) -> Array:
    """What compiled code reads of a motion, (5, n): position, velocity, inertia of the link, weight, and its slope."""
    slope = np.broadcast_to(motion.weight_slope, motion.position.shape)
    return np.stack((motion.position, motion.velocity, motion.link, motion.weight, slope))


def _begins(motion: Motion, axis: AxisDynamics, passes: Array, swing: float, warmth: float) -> Array:
    """Ways in which a replay may begin (k, 3): torque that passes the spring, how it grows a second, and the flank of the gap.

    In motion it is as measured; each further one, on either flank of a gap, is corrected by the first swings. At rest the load
    may lie anywhere in a gap, and its spring may be wound up as far as friction holds; what no friction could hold is the
    weight, for a brake has the motor.
    """
    law, gear = axis.friction, axis.transmission
    count = min(len(passes), max(_FEWEST, round(_FIRST_SWING / (swing * motion.period)) + 1))
    hangs, grows = _line(passes[:count], motion.period)
    if motion.kept("at first", _at_first)[0] != 0.0:
        measured = np.sign(hangs)
        flanks = (measured, -1.0, 1.0) if gear.gap > 0.0 else (measured, measured)
        return np.array([(hangs, grows, flank) for flank in flanks])
    weight, level = float(motion.weight[0]), max(law.coulomb, law.static_torque) * warmth
    if abs(hangs - weight) > level:
        hangs = weight if abs(weight) > level else 0.0
    wound = (hangs, 0.0, np.sign(hangs))
    lies = [(0.0, 0.0, flank) for flank in _FLANKS] if gear.gap > 0.0 and abs(weight) <= level else []
    return np.array([wound, *lies])


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
def _follow(load, hangs, grows, flank, count, found, moves) -> None:  # type: ignore[no-untyped-def]
    """The first `count` samples of what is `found` (3, n) of a link (n,) on a spring, and how it `moves` (n,); `wave` [rad a
    rad or m]. The weight of a `track` is that where the motor is, with a slope.
    """
    law, gear, stiffness, wave, track, warmth, varying, begins, period, steps = load
    position, velocity, link, weight, slope = track
    torque, place = found[0], found[2]
    h, part, half_gap, damping = period / steps, 1.0 / steps, 0.5 * gear.gap, gear.damping
    bristle, bristle_damping = law.presliding_stiffness / BRISTLES, law.presliding_damping / BRISTLES
    gives_way = stiffness * _IMPLICIT * h + damping
    untwisted, ratio = _uneven(gear, wave, position[0])
    q, v = _start(gear, stiffness, untwisted, ratio * begins, hangs, grows, flank)
    through = hangs
    torque[0], moves[0], place[0] = ratio * through, v, q
    anchors = np.full(BRISTLES, q)
    for k in range(count - 1):
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
    _slopes(moves, period, count, found[1])
    for k in range(count):
        place[k] -= position[k]


@compiled
def _replay(load, passes, begins, swing, found, moves) -> None:  # type: ignore[no-untyped-def]
    """All samples of that, from where of several ways to begin (k, 3) the torque that passes says the load began."""
    _, gear, _, _, track, _, _, velocity, period, _ = load
    best = 0
    if begins.shape[0] > 1:
        swings = min(passes.shape[0], max(_FEWEST, ceil(_FIRST_SWINGS * 2.0 * pi / (swing * period))))
        if velocity != 0.0:
            for way in range(1, begins.shape[0]):
                _as_it_swings(load, passes, begins[way], swing, swings, found, moves)
        few = max(swings, _taken_up(track[0], 2.0 * gear.gap, round(_TAKEN_UP / period)))
        least = inf
        for way in range(begins.shape[0]):
            hangs, grows, flank = begins[way]
            _follow(load, hangs, grows, flank, few, found, moves)
            missed = np.sum((found[0, :few] - passes[:few]) ** 2)
            if missed < least:
                best, least = way, missed
    hangs, grows, flank = begins[best]
    _follow(load, hangs, grows, flank, passes.shape[0], found, moves)


@compiled
def _as_it_swings(load, passes, begin, swing, count, found, moves) -> None:  # type: ignore[no-untyped-def]
    """A way to `begin` (3,) in motion, corrected in place by what its first swings, `count` samples, miss of the measured
    torque: a Gauss-Newton step; as it is where they do not determine both of its values.

    A link that hardly damps keeps for long what noise or a coarse torque made of its first samples: of an output error, initial
    conditions are estimated as well (Ljung, System Identification, 1999, sec. 3.2).
    """
    hangs, grows, flank = begin
    size = np.max(passes[:count]) - np.min(passes[:count])
    if size == 0.0:
        size = 1.0
    missed = np.empty((3, count))
    for trial in range(3):
        hung, grown = size * (trial == 1), swing * size * (trial == 2)
        _follow(load, hangs + hung, grows + grown, flank, count, found, moves)
        missed[trial] = passes[:count] - found[0, :count]
    here, first, second = missed[0], (missed[0] - missed[1]) / size, (missed[0] - missed[2]) / size
    length = sqrt(np.sum(first**2))
    if not 0.0 < length < inf:
        return
    along = np.sum(first * second) / length
    rest = second - first * (along / length)
    apart = sqrt(np.sum(rest**2))
    if not _PARALLEL * sqrt(np.sum(second**2)) < apart < inf:
        return
    faster = np.sum(rest * here) / apart**2
    begin[0] = hangs + (np.sum(first * here) / length - along * faster) / length
    begin[1] = grows + swing * faster


@compiled
def _taken_up(position, far, after):  # type: ignore[no-untyped-def]
    """Samples in which a motor first moves so `far`, wherever its load lies in a gap, and some `after` that."""
    for k in range(position.shape[0]):
        if abs(position[k] - position[0]) > far:
            return min(position.shape[0], max(_FEWEST, k + 1) + after)
    return min(position.shape[0], _FEWEST + after)


@compiled
def _slopes(samples, period, count, slopes) -> None:  # type: ignore[no-untyped-def]
    """Central differences of the first `count` of samples (n,), one-sided at both ends."""
    last = count - 1
    slopes[0], slopes[last] = (samples[1] - samples[0]) / period, (samples[last] - samples[last - 1]) / period
    for k in range(1, last):
        slopes[k] = (samples[k + 1] - samples[k - 1]) / (2.0 * period)


@compiled
def _speed_after(force, level, gives):  # type: ignore[no-untyped-def]
    """Speed after a step of the theta rule, from the force of all but friction; it sticks where friction can hold that.

    `gives`: speed by force, of what resists in a step.
    """
    return 0.0 if abs(force) <= level else (force - copysign(level, force)) * gives
