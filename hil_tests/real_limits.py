"""How far, fast and hard real axes may be driven: checks that a bench's limits are within the machine's."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from pathlib import Path

from drivetwin.emulator.machine import Machine
from drivetwin.foundation.errors import UserError
from drivetwin.motion.limits_file import Bounds


def machine_bounds(machine: Machine) -> Mapping[str, Bounds]:
    """What every axis of a machine bears: from switch to switch, the speed of its rotor, the peak torque of its drive."""
    return {
        name: Bounds(
            travel=(axis.limit_switches.negative, axis.limit_switches.positive),
            speed=inf if axis.motor.max_speed is None else axis.motor.max_speed / axis.gear_ratio,
            torque=axis.motor.peak_torque * axis.gear_ratio,
        )
        for name, axis in machine.axes.items()
    }


def check_narrower(limits: Mapping[str, Bounds], wider: Mapping[str, Bounds], whose: str, path: Path) -> None:
    """Raise UserError for a limit of the file `path` that is wider than `wider`, which `whose` names."""
    for axis, own in limits.items():
        other = wider[axis]
        if own.travel[0] < other.travel[0] or own.travel[1] > other.travel[1]:
            raise UserError(f"{path}: {axis}: travel {list(own.travel)} is wider than {list(other.travel)} of {whose}")
        for name, mine, its in (("speed", own.speed, other.speed), ("torque", own.torque, other.torque)):
            if mine > its:
                raise UserError(f"{path}: {axis}: {name} {mine:g} is more than {its:g} of {whose}")
