"""How far, fast and hard real axes may be driven on a bench: the limits file, and that it is narrower than the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path

from pydantic import FiniteFloat, PositiveFloat, field_validator

from drivetwin.emulator.machine import Machine
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.strict import Strict, read_yaml, typed


@dataclass(frozen=True)
class Bounds:
    """Joint side: travel [m or rad], greatest speed [m/s or rad/s] and torque [N or N·m]."""

    travel: tuple[float, float]
    speed: float
    torque: float


class AxisLimits(Strict):
    """An axis of a limits file, units as those of `Bounds`."""

    travel: tuple[FiniteFloat, FiniteFloat]
    speed: PositiveFloat
    torque: PositiveFloat

    @field_validator("travel")
    @classmethod
    def _lowest_first(cls, travel: tuple[float, float]) -> tuple[float, float]:
        if not travel[0] < travel[1]:
            raise ValueError(f"expected [lowest, highest], not {list(travel)}")
        return travel


class _File(Strict):
    axes: dict[str, AxisLimits]


def read_limits(path: Path, axes: tuple[str, ...]) -> Mapping[str, Bounds]:
    """The limits of every axis of a machine, in its order. Raises UserError naming the file and what is missing or wrong."""
    given = typed(_File, read_yaml(path), path).axes
    if set(given) != set(axes):
        raise UserError(f"{path}: axes: limits of {', '.join(given) or 'none'}, and the machine has {', '.join(axes)}")
    return {axis: Bounds(given[axis].travel, given[axis].speed, given[axis].torque) for axis in axes}


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
