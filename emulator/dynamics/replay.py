"""The motor torque of a measured motion: the motor moves as measured, and what it drives follows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.carried import carried
from drivetwin.emulator.dynamics.motion import Motion
from drivetwin.emulator.dynamics.sprung import load_on_a_spring
from drivetwin.emulator.dynamics.transmission import Transmission


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
    motion = motion.of_a_late_encoder(axis.encoder.delay) if axis.has_waves else motion
    truth = axis.encoder.truth(motion, axis.gear_ratio)
    there = followed(truth, axis.mechanics)
    current, joint = axis.by_current(there.torque, truth), truth.position + there.ahead
    acceleration = there.acceleration
    if not axis.transmission.elastic:
        acceleration = acceleration - axis.encoder.unknown(motion, truth, axis.gear_ratio)
    if axis.encoder.delay > 0.0:
        steps = _steps(carried(truth, axis), axis)
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


def _without_friction(motion: Motion) -> NDArray[np.float64]:
    """What a rigid gear without friction asks of the motor beside its own inertia, (n,); shared, not to be written to."""
    return motion.kept("without friction", lambda same: same.weight + same.link * same.acceleration)


def _at_rest(motion: Motion) -> NDArray[np.float64]:
    """Zeros (n,): how far a rigid gear lets the joint move ahead; shared, not to be written to."""
    return motion.kept("rigid", lambda same: np.zeros_like(same.position))


def _through_a_rigid_gear(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Torque that the load asks of the motor, acceleration and deflection of the joint, (3, n): by virtual work."""
    if axis.transmission.error_amplitude == 0.0:
        return np.stack((_without_friction(motion) + axis.friction.resistance(motion), motion.acceleration, _at_rest(motion)))
    joint, ratio, known = _at_the_joint(motion, axis.transmission, axis.gear_ratio)
    ahead = joint.position - motion.position
    weight = motion.weight + motion.weight_slope * ahead
    torque = (weight + motion.link * joint.acceleration + axis.friction.resistance(joint)) * ratio
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
    needed = motion.rigid_torque + motion.link * (acceleration - motion.acceleration)
    joint = replace(motion, position=position, velocity=velocity, acceleration=acceleration, rigid_torque=needed)
    return joint, 1.0 + gear.error_amplitude * wave * motion.wave(angle + 0.5 * pi, wave), known


def _through_a_spring(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """The same of a load on a spring, whose motor moves as measured and bears a share of the friction."""
    share = axis.transmission.motor_friction_share
    shaft = motion.kept("shaft", lambda same: same.torque - same.rotor_inertia * same.acceleration)
    varying = axis.friction.varying_level(motion)
    if share == 0.0:
        return load_on_a_spring(motion, axis, shaft, varying)
    held = share * motion.kept_lately(axis.friction, axis.friction.resistance)
    found = load_on_a_spring(motion, axis.behind_the_spring, shaft - held, (1.0 - share) * varying)
    found[0] += held
    return found
