"""The real motor, compared with what its drive assumes: torque constant, saturation, cogging, limits of the power stage."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asinh, inf, isfinite, sin, sinh, sqrt

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.motion import Motion, Wave
from drivetwin.foundation.compiled import compiled, in_place


@dataclass(frozen=True)
class Motor:
    """Shaft torque = (1 + constant_error) T + offset + ripples, of T (1 + (T / knee)²) that is reported.

    Torques on the joint side [N·m or N]. `current_limit` [N·m or N]: the current that the power stage gives ends there;
    `bandwidth` [Hz]: the current loop's, 0 where it is as the drive was commissioned. The reported torque is the measured
    current's, so the drive sees these two and none of the others.
    """

    constant_error: float = 0.0
    offset: float = 0.0
    knee: float = inf
    current_limit: float = inf
    bandwidth: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether the shaft gives anything else than the drive reports."""
        return any((self.constant_error, self.offset, isfinite(self.knee)))

    def reported(self, shaft: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the drive reports (n,) while the shaft gives a torque (n,) beside ripples."""
        linear = (shaft - self.offset) / (1.0 + self.constant_error)
        return linear * (1.0 + (linear / self.knee) ** 2) if isfinite(self.knee) else linear


@in_place
def apply_motors(motors, torque) -> None:  # type: ignore[no-untyped-def]  # record arrays have no static type
    """Turn reported motor torques into shaft torques."""
    for row in range(motors.shape[0]):
        motor = motors[row]
        linear = _linear(torque[motor.actuator], motor.knee / motor.gear)
        torque[motor.actuator] = (1.0 + motor.constant_error) * linear + motor.offset / motor.gear


@compiled
def _linear(given: float, knee: float) -> float:
    """The real root x of x + x³ / knee² = given, by hyperbolic functions: Nickalls, Mathematical Gazette 77(480), 1993."""
    if not isfinite(knee):
        return given
    return 2.0 * knee / sqrt(3.0) * sinh(asinh(1.5 * sqrt(3.0) * given / knee) / 3.0)


@dataclass(frozen=True)
class Ripple:
    """Torque amplitude sin(order angle + phase) on the shaft, whatever the current; joint side, N·m or N; motor angle [rad]."""

    amplitude: float
    order: float
    phase: float = 0.0

    def on(self, motion: Motion, gear_ratio: float) -> NDArray[np.float64]:
        """Torque (n,) on the way of a joint, as it is recorded."""
        angle = self.order * (gear_ratio * motion.position) + self.phase
        return self.amplitude * motion.wave(angle, self.order * gear_ratio)

    def unseen(self, motion: Motion, truth: Motion, gear_ratio: float) -> Wave | None:
        """The torque on the true way of a joint, as far as no recording shows how it moves that; None: nowhere."""
        number = self.order * gear_ratio
        wave = motion.unseen_wave(number * truth.position + self.phase, number)
        return None if wave is None else replace(wave.times(self.amplitude), followed=False, pushes=1.0)


@in_place
def apply_ripples(ripples, position, torque) -> None:  # type: ignore[no-untyped-def]
    """Add ripples to the shaft torques; after the motors, for no torque constant scales them."""
    for row in range(ripples.shape[0]):
        ripple = ripples[row]
        angle = ripple.gear * position[ripple.motor_qpos]
        torque[ripple.actuator] += ripple.amplitude * sin(ripple.order * angle + ripple.phase) / ripple.gear
