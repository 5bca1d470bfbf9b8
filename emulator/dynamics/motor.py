"""The real motor, compared with what its drive assumes: torque constant, cogging, and limits of the power stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sin

import mujoco

from drivetwin.emulator.dynamics.place import Place
from drivetwin.emulator.dynamics.records import records
from drivetwin.foundation.compiled import compiled


@dataclass(frozen=True)
class Motor:
    """Shaft torque = (1 + constant_error) reported torque + offset + ripples.

    Torques on the joint side [N·m or N]. `current_limit` [N·m or N]: the current that the power stage gives ends there;
    `bandwidth` [Hz]: the current loop's, 0 where it is as the drive was commissioned. The reported torque is the measured
    current's, so the drive sees these two and none of the others.
    """

    constant_error: float = 0.0
    offset: float = 0.0
    current_limit: float = inf
    bandwidth: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether the shaft gives anything else than the drive reports."""
        return any((self.constant_error, self.offset))


@compiled
def _apply(motors, torque) -> None:  # type: ignore[no-untyped-def]  # record arrays have no static type
    for row in range(motors.shape[0]):
        motor = motors[row]
        torque[motor.actuator] = (1.0 + motor.constant_error) * torque[motor.actuator] + motor.offset / motor.gear


@dataclass(frozen=True)
class Ripple:
    """Torque amplitude sin(order angle + phase) on the shaft, whatever the current; joint side, N·m or N; motor angle [rad]."""

    amplitude: float
    order: float
    phase: float = 0.0


@compiled
def _apply_ripples(ripples, position, torque) -> None:  # type: ignore[no-untyped-def]
    for row in range(ripples.shape[0]):
        ripple = ripples[row]
        angle = ripple.gear * position[ripple.motor_qpos]
        torque[ripple.actuator] += ripple.amplitude * sin(ripple.order * angle + ripple.phase) / ripple.gear


class Motors:
    """The motors that give anything else than their drives report."""

    def __init__(self, motors: Sequence[tuple[Motor, Place]], data: mujoco.MjData) -> None:
        self._motors = records(motors)
        self._torque = data.ctrl

    def act(self) -> None:
        """Turn reported motor torques into shaft torques."""
        _apply(self._motors, self._torque)


class Ripples:
    """The ripples of all motors; act after Motors, for no torque constant scales them."""

    def __init__(self, ripples: Sequence[tuple[Ripple, Place]], data: mujoco.MjData) -> None:
        self._ripples = records(ripples)
        self._arrays = (data.qpos, data.ctrl)

    def act(self) -> None:
        """Add them to the shaft torques of the coming step."""
        _apply_ripples(self._ripples, *self._arrays)
