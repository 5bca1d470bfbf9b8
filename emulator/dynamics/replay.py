"""The motor torque of a measured motion: the motor moves as measured, and what it drives follows."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, copysign, cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.friction import BRISTLES, FrictionLaw, bristles_torque, level_at
from drivetwin.emulator.dynamics.motion import Motion
from drivetwin.emulator.dynamics.records import records
from drivetwin.emulator.dynamics.transmission import Transmission
from drivetwin.foundation.compiled import compiled

_IMPLICIT = 0.52
"""Share of the new value in the theta rule: hardly more than a half, so that a spring too stiff to follow dies out."""
_LONGEST_STEP = 5e-4
_MOST_STEPS = 16
_STEPS_PER_RADIAN = 4.0


def motor_torque(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Motor torque (n,) that an axis with its friction and its transmission costs; joint side, N·m or N.

    A rigid gear of constant ratio: rigid_torque + friction. Else inverse dynamics of the motor, whose motion is measured, and
    forward dynamics of the joint behind it (two-mass system, Spong 1987). Weight and Coriolis torque are those at the motor.
    """
    return replayed(motion, axis)[0]


def replayed(motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`motor_torque` (n,), and the acceleration (n,) of the joint meanwhile."""
    through = _through_a_spring if axis.transmission.elastic else _through_a_rigid_gear
    load, acceleration = through(motion, axis)
    return np.asarray(motion.rotor_inertia * motion.acceleration + load), acceleration


def needed_torque(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """The same of the axis on which effects are tried, computed once a motion."""
    return motion.kept(axis, lambda same: motor_torque(same, axis))


def needed_acceleration(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Acceleration (n,) of the joint of the axis on which effects are tried, computed once a motion."""
    return motion.kept(("joint", axis), lambda same: replayed(same, axis)[1])


def _weight(motion: Motion) -> NDArray[np.float64]:
    """What the rigid machine needs beside its inertia, (n,)."""
    return np.asarray(motion.rigid_torque - motion.inertia * motion.acceleration)


def _through_a_rigid_gear(motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Torque (n,) that the load asks of the motor, by virtual work on the joint's motion, and the joint's acceleration (n,)."""
    joint, ratio = _at_the_joint(motion, axis.transmission, axis.gear_ratio)
    link = motion.inertia - motion.rotor_inertia
    torque = (_weight(motion) + link * joint.acceleration + axis.friction.resistance(joint)) * ratio
    return np.asarray(torque), joint.acceleration


def _at_the_joint(motion: Motion, gear: Transmission, gear_ratio: float) -> tuple[Motion, NDArray[np.float64]]:
    """How the joint moves on a rigid gear, and d joint / d motor on the way (n,): q = m + e(m), m as measured."""
    if gear.error_amplitude == 0.0:
        return motion, np.ones_like(motion.position)
    wave = gear.error_order * gear_ratio
    angle = wave * motion.position + gear.error_phase
    ratio = 1.0 + gear.error_amplitude * wave * np.cos(angle)
    position = motion.position + gear.error_amplitude * np.sin(angle)
    bend = gear.error_amplitude * wave**2 * np.sin(angle) * motion.velocity**2
    velocity, acceleration = ratio * motion.velocity, ratio * motion.acceleration - bend
    return replace(motion, position=position, velocity=velocity, acceleration=acceleration), ratio


def _through_a_spring(motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Torque (n,) through the spring between a motor that moves as measured and its load, and the load's acceleration (n,)."""
    law, gear, link = axis.friction, axis.transmission, motion.inertia - motion.rotor_inertia
    swing = sqrt((gear.stiffness + law.presliding_stiffness) / float(np.median(link)))
    steps = max(ceil(motion.period / _LONGEST_STEP), ceil(_STEPS_PER_RADIAN * swing * motion.period))
    torque, speed = np.empty_like(motion.position), np.zeros_like(motion.position)
    _follow(
        records((FrictionLaw,), [(law,)])[0],
        records((Transmission,), [(gear,)])[0],
        gear.error_order * axis.gear_ratio,
        motion.position,
        motion.velocity,
        link,
        _weight(motion),
        law.warmth(motion),
        law.varying_level(motion),
        motion.period,
        min(_MOST_STEPS, steps),
        torque,
        speed,
    )
    return torque, np.gradient(speed, motion.period)


@compiled
def _uneven(gear, wave, motor):  # type: ignore[no-untyped-def]  # record arrays have no static type
    """Where an untwisted transmission would have the joint, and d joint / d motor there."""
    if gear.error_amplitude == 0.0:
        return motor, 1.0
    angle = wave * motor + gear.error_phase
    return motor + gear.error_amplitude * sin(angle), 1.0 + gear.error_amplitude * wave * cos(angle)


@compiled
def _start(law, gear, untwisted, weight, warmth, varying):  # type: ignore[no-untyped-def]
    """Joint position at first, and what hangs on the spring: the weight, but none where friction holds that."""
    hangs = weight if abs(weight) > warmth * (level_at(law, 0.0) + varying) else 0.0
    return untwisted - hangs / gear.stiffness - (copysign(0.5 * gear.gap, hangs) if hangs != 0.0 else 0.0), hangs


@compiled
def _viscous(law, v):  # type: ignore[no-untyped-def]
    speed = abs(v)
    direction = law.viscous_asymmetry if v > 0.0 else -law.viscous_asymmetry
    return law.viscous + direction + law.quadratic * speed + law.cubic * speed**2


@compiled
def _follow(  # type: ignore[no-untyped-def]
    law, gear, wave, position, velocity, link, weight, warmth, varying, period, steps, torque, moves
) -> None:
    """Torque (n,) of the motor on the spring of a link (n,), which `moves` (n,), as it is moved; `wave` [rad a rad or m]."""
    h = period / steps
    untwisted, ratio = _uneven(gear, wave, position[0])
    q, through = _start(law, gear, untwisted, weight[0], warmth[0], varying[0])
    torque[0], v = ratio * through, 0.0
    anchors = np.full(BRISTLES, q)
    for k in range(position.shape[0] - 1):
        level = max(0.0, warmth[k] * (level_at(law, abs(v)) + varying[k]))
        viscous = warmth[k] * _viscous(law, v)
        constant = weight[k] + warmth[k] * law.coulomb_asymmetry
        bend = 0.5 * (velocity[k + 1] - velocity[k]) * period
        for step in range(steps):
            share = (step + 1) / steps
            motor = position[k] + share * (position[k + 1] - position[k]) - share * (1.0 - share) * bend
            rate = velocity[k] + share * (velocity[k + 1] - velocity[k])
            ahead = q + h * v
            untwisted, ratio = _uneven(gear, wave, motor)
            twist = untwisted - ahead
            flank = copysign(0.5 * gear.gap, twist)
            against, holds = constant, level
            if law.presliding_stiffness > 0.0:
                against, holds = constant + bristles_torque(law, anchors, level, ahead, v), 0.0
            last, speed, pushes = q, v, 0.0
            touching = abs(twist) > 0.5 * gear.gap or gear.gap == 0.0
            if touching:
                end, turns = untwisted - flank, ratio * rate
                q, v, pushes = _step(
                    last, speed, through, end, turns, gear.stiffness, gear.damping, link[k], viscous, against, holds, h
                )
            if not touching or pushes * flank < 0.0:
                q, v, pushes = _step(last, speed, through, 0.0, 0.0, 0.0, 0.0, link[k], viscous, against, holds, h)
            through = pushes
        torque[k + 1] = ratio * through
        moves[k + 1] = v


@compiled
def _step(  # type: ignore[no-untyped-def]
    q, v, through, end, rate, stiffness, damping, link, viscous, constant, level, h
):
    """Position, velocity and spring torque after a time `h`: theta rule, and a friction that sticks where it can."""
    given = stiffness * (end - q - h * (1.0 - _IMPLICIT) * v) + damping * rate
    gives_way = stiffness * _IMPLICIT * h + damping
    inert = link / h + _IMPLICIT * (gives_way + viscous)
    momentum = link / h * v + _IMPLICIT * given + (1.0 - _IMPLICIT) * (through - viscous * v) - constant
    stuck = abs(momentum) <= level
    faster = 0.0 if stuck else (momentum - copysign(level, momentum)) / inert
    return q + h * (_IMPLICIT * faster + (1.0 - _IMPLICIT) * v), faster, given - gives_way * faster
