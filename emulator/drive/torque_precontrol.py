"""Torque added ahead of the current loop: the friction table, constant torque and additive torque of a ServoOne.

P386 CON_SCON_TFric[0..4] is in per cent of the motor's rated torque, P387 CON_SCON_TFricSpeed[0..4] in rpm, P388
CON_SCON_TConst acts in one direction whatever the speed. Entries 3 and 4 act only while the axis accelerates. How the drive
goes from point to point is not public. Here: a straight line between the points in order of speed, constant beyond the last,
from zero speed on constant before the first, in the direction of the demanded speed; P388 in per cent too. A point at 0 %
and 0 rpm is an unused one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.drive_profiles import Role
from drivetwin.emulator.canopen.object_dictionary import Variable
from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.objects import optional
from drivetwin.emulator.drive.servo import TORQUE_OFFSET, VELOCITY, VELOCITY_OFFSET, Loop

POINTS = 5
ALWAYS_ACTIVE = 3
"""Points 0..2; the others act only while accelerating."""

Array = NDArray[np.float64]


class TorquePrecontrol:
    """Adds to the torque demand of a cycle what the objects of roles `friction_*` and `additive_torque` say."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._additive = axis.role("additive_torque")
        self._constant = axis.role("friction_constant")
        self._torques = _entries(axis, "friction_torque")
        self._speeds = _entries(axis, "friction_speed")
        self._added = [variable for variable in (self._additive, self._constant) if variable is not None]
        self.refresh()

    def refresh(self) -> None:
        """Read the objects anew."""
        self._adds = any(variable.value for variable in self._added)
        used = any(variable.value for variable in (*self._torques, *self._speeds))
        self._table = self._read() if self._torques and self._speeds and used else None

    def add(self) -> None:
        """Act on the demand that is planned, where the loops are closed."""
        if not self._adds and self._table is None:
            return
        servo = self._axis.servo
        loop = servo.loop
        if loop is Loop.OFF:
            return
        servo.fill_demand()
        if self._adds:
            servo.demand[:, TORQUE_OFFSET] += self._additive_torque()
        if loop is not Loop.TORQUE and self._table is not None:
            servo.demand[:, TORQUE_OFFSET] += self.friction(servo.demand[:, VELOCITY] + servo.demand[:, VELOCITY_OFFSET])

    def friction(self, speed: Array) -> Array:
        """Torque (n,) [N·m] of demanded motor speeds (n,) [rad/s], one a servo period."""
        if self._table is None:
            return np.zeros_like(speed)
        speeds, torques = self._table
        amount = np.abs(speed)
        accelerating = np.diff(amount, prepend=2.0 * amount[0] - amount[min(1, len(amount) - 1)]) > 0.0
        steady = _level(amount, speeds[:ALWAYS_ACTIVE], torques[:ALWAYS_ACTIVE])
        level = np.where(accelerating, _level(amount, speeds, torques), steady)
        return np.asarray(level * np.sign(speed))

    def _additive_torque(self) -> float:
        """[N·m]"""
        torque = self._si("additive_torque", self._additive)
        if self._constant is not None and self._constant.value != 0.0:
            torque += self._si("friction_constant", self._constant) * self._rated()
        return torque

    def _read(self) -> tuple[Array, Array]:
        """Speeds [rad/s] and torques [N·m] of the points (5,)."""
        roles = self._axis.profile.roles
        torques, speeds = (np.array([float(one.value) for one in some]) for some in (self._torques, self._speeds))
        share = roles["friction_torque"].si_per_unit
        return np.abs(speeds) * roles["friction_speed"].si_per_unit, torques * share * self._rated()

    def _si(self, name: str, variable: Variable | None) -> float:
        return 0.0 if variable is None else float(variable.value) * self._axis.profile.roles[name].si_per_unit

    def _rated(self) -> float:
        return self._axis.rated_torque()


def _entries(axis: Axis, name: str) -> list[Variable]:
    """The five entries of a table whose first one plays a role; none where the drive type has no such role or not all five."""
    first: Role | None = axis.profile.roles.get(name)
    if first is None:
        return []
    entries = [optional(axis.dictionary, first.index, first.subindex + entry) for entry in range(POINTS)]
    found = [entry for entry in entries if entry is not None]
    return found if len(found) == POINTS else []


def _level(amount: Array, speeds: Array, torques: Array) -> Array:
    used = (speeds != 0.0) | (torques != 0.0)
    if not used.any():
        return np.zeros_like(amount)
    order = np.argsort(speeds[used], kind="stable")
    return np.asarray(np.interp(amount, speeds[used][order], torques[used][order]))
