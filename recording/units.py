"""Units that drives export, as factors to SI; the units allowed for each column of a recording."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from enum import Enum

from drivetwin.foundation.errors import UserError


class Kind(Enum):
    """What a unit measures."""

    TIME = "time"
    LENGTH = "length"
    ANGLE = "angle"
    SPEED = "speed"
    ANGULAR_SPEED = "angular speed"
    FORCE = "force"
    TORQUE = "torque"
    CURRENT = "current"
    VOLTAGE = "voltage"
    RATIO = "share of rated torque"
    INCREMENTS = "encoder increments"
    INCREMENT_RATE = "encoder increments a second"
    USER = "position units of the drive's factor group"
    USER_RATE = "position units of the drive's factor group a second"
    TEMPERATURE = "temperature"


@dataclass(frozen=True)
class Unit:
    """`SI value = factor * value + zero`."""

    kind: Kind
    factor: float
    zero: float = 0.0


_TURN = 2 * math.pi
_DEGREE = math.pi / 180

UNITS: dict[str, Unit] = {
    "s": Unit(Kind.TIME, 1.0),
    "ms": Unit(Kind.TIME, 1e-3),
    "us": Unit(Kind.TIME, 1e-6),
    "ns": Unit(Kind.TIME, 1e-9),
    "min": Unit(Kind.TIME, 60.0),
    "m": Unit(Kind.LENGTH, 1.0),
    "cm": Unit(Kind.LENGTH, 1e-2),
    "mm": Unit(Kind.LENGTH, 1e-3),
    "um": Unit(Kind.LENGTH, 1e-6),
    "nm": Unit(Kind.LENGTH, 1e-9),
    "rad": Unit(Kind.ANGLE, 1.0),
    "mrad": Unit(Kind.ANGLE, 1e-3),
    "deg": Unit(Kind.ANGLE, _DEGREE),
    "mdeg": Unit(Kind.ANGLE, 1e-3 * _DEGREE),
    "rev": Unit(Kind.ANGLE, _TURN),
    "m/s": Unit(Kind.SPEED, 1.0),
    "mm/s": Unit(Kind.SPEED, 1e-3),
    "um/s": Unit(Kind.SPEED, 1e-6),
    "m/min": Unit(Kind.SPEED, 1 / 60),
    "mm/min": Unit(Kind.SPEED, 1e-3 / 60),
    "rad/s": Unit(Kind.ANGULAR_SPEED, 1.0),
    "deg/s": Unit(Kind.ANGULAR_SPEED, _DEGREE),
    "rev/s": Unit(Kind.ANGULAR_SPEED, _TURN),
    "rpm": Unit(Kind.ANGULAR_SPEED, _TURN / 60),
    "N": Unit(Kind.FORCE, 1.0),
    "mN": Unit(Kind.FORCE, 1e-3),
    "kN": Unit(Kind.FORCE, 1e3),
    "N·m": Unit(Kind.TORQUE, 1.0),
    "mN·m": Unit(Kind.TORQUE, 1e-3),
    "uN·m": Unit(Kind.TORQUE, 1e-6),
    "N·cm": Unit(Kind.TORQUE, 1e-2),
    "kN·m": Unit(Kind.TORQUE, 1e3),
    "A": Unit(Kind.CURRENT, 1.0),
    "mA": Unit(Kind.CURRENT, 1e-3),
    "V": Unit(Kind.VOLTAGE, 1.0),
    "mV": Unit(Kind.VOLTAGE, 1e-3),
    "%": Unit(Kind.RATIO, 1e-2),
    "permille": Unit(Kind.RATIO, 1e-3),
    "inc": Unit(Kind.INCREMENTS, 1.0),
    "inc/s": Unit(Kind.INCREMENT_RATE, 1.0),
    "user": Unit(Kind.USER, 1.0),
    "user/s": Unit(Kind.USER_RATE, 1.0),
    "degC": Unit(Kind.TEMPERATURE, 1.0),
    "K": Unit(Kind.TEMPERATURE, 1.0, -273.15),
}

_ALIASES = {
    "sec": "s",
    "°": "deg",
    "°/s": "deg/s",
    "turn": "rev",
    "U": "rev",
    "RPM": "rpm",
    "1/min": "rpm",
    "min-1": "rpm",
    "U/min": "rpm",
    "rev/min": "rpm",
    "r/min": "rpm",
    "% of rated": "%",
    "‰": "permille",
    "per mille": "permille",
    "per mille of rated": "permille",
    "count": "inc",
    "counts": "inc",
    "counts/s": "inc/s",
    "°C": "degC",
    "C": "degC",
}

_POSITION = (Kind.LENGTH, Kind.ANGLE, Kind.INCREMENTS, Kind.USER)
_VELOCITY = (Kind.SPEED, Kind.ANGULAR_SPEED, Kind.INCREMENT_RATE, Kind.USER_RATE)
_TORQUE = (Kind.TORQUE, Kind.FORCE, Kind.CURRENT, Kind.VOLTAGE, Kind.RATIO)

ALLOWED: dict[str, tuple[Kind, ...]] = {
    "time": (Kind.TIME,),
    "torque": _TORQUE,
    "torque_offset": _TORQUE,
    "position": _POSITION,
    "position_demand": _POSITION,
    "velocity": _VELOCITY,
    "velocity_demand": _VELOCITY,
    "velocity_offset": _VELOCITY,
    "joint_position": _POSITION,
    "joint_velocity": _VELOCITY,
    "joint_torque": _TORQUE,
    "temperature": (Kind.TEMPERATURE,),
}

_NEWTON_METRE = re.compile(r"N\s*[·⋅.*]?\s*(c?m)$")


def canonical(text: str) -> str | None:
    """The table's spelling of a unit (`Nm`, `N.m`, `[rpm]`, `µm` are understood), None where it is no unit."""
    plain = text.strip().removeprefix("[").removesuffix("]").strip().replace("µ", "u").replace("μ", "u")
    plain = _NEWTON_METRE.sub(r"N·\1", plain)
    plain = _ALIASES.get(plain, plain)
    return plain if plain in UNITS else None


def unit_for(column: str, text: str) -> Unit:
    """The unit `text` for a column named as in the contract (or `time`); raises UserError naming what is possible."""
    allowed = [name for name, unit in UNITS.items() if unit.kind in ALLOWED[column]]
    name = canonical(text)
    if name not in allowed:
        raise UserError(f"{text!r} is not a unit for {column}; one of: {', '.join(allowed)}")
    return UNITS[name]


def quantity(value: float | str, kinds: tuple[Kind, ...]) -> float:
    """A constant as a number in SI, or as `"9.84 mN·m"`; the value in SI. Raises ValueError naming what is possible."""
    if not isinstance(value, str):
        return float(value)
    match = re.fullmatch(r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*)", value.strip())
    if match is None:
        raise ValueError(f"{value!r} is neither a number in SI units nor a number with a unit")
    if not match[2]:
        return float(match[1])
    name = canonical(match[2])
    allowed = [known for known, unit in UNITS.items() if unit.kind in kinds]
    if name not in allowed:
        raise ValueError(f"{match[2]!r} in {value!r} is not a unit allowed here; one of: {', '.join(allowed)}")
    return UNITS[name].factor * float(match[1])
