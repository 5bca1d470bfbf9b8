"""The arm's lengths from its drawing (geometry.yaml), its belts, and the travel of its axes."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from pathlib import Path
from typing import Annotated

import numpy as np
import yaml
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from drivetwin.controller.machine import Machine
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Samples

DRAWING = Path(__file__).with_name("geometry.yaml")

JOINTS = ("lift", "rotate", "stretch", "elbow", "wrist")
"""The machine's joints d1, theta2 .. theta5 by their names in its models; belts drive the last two from the third."""

BELTS: Samples = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 0.0, 1.0]])
"""d (d1, theta2, theta3, theta4, theta5) / d (lift, rotate, stretch), (5, 3)."""

BELT_OFFSET: Samples = np.array([0.0, 0.0, 0.0, pi, -pi / 2.0])
"""theta4 = 180 deg - 2 theta3, theta5 = -90 deg + theta3."""

_Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
_Length = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)]


@dataclass(frozen=True)
class Geometry:
    """Lengths of the modified DH table [m]: a = 0, 0, 0, arm, arm, blade; d = column + lift, 0, d3, d4, d5, 0; alpha = 0."""

    arm: _Length
    blade: _Length
    column: _Finite
    d3: _Finite
    d4: _Finite
    d5: _Finite

    __pydantic_config__ = ConfigDict(extra="forbid")

    @property
    def height(self) -> float:
        """Height of the tool point where the lift stands at 0 [m]."""
        return self.column + self.d3 + self.d4 + self.d5


@dataclass(frozen=True)
class Travel:
    """First and last position of lift [m], rotate and stretch [rad]."""

    lift: tuple[float, float]
    rotate: tuple[float, float]
    stretch: tuple[float, float]


FULL_TRAVEL = Travel(lift=(-inf, inf), rotate=(-pi, pi), stretch=(-pi / 2.0, pi / 2.0))
"""As far as the inverse kinematics is unique: stretch and pi - stretch have the same pose."""


def travel_of(machine: Machine) -> Travel:
    """The travel that axes.yaml gives lift, rotate and stretch."""
    axes = machine.axes
    return Travel(axes["lift"].travel, axes["rotate"].travel, axes["stretch"].travel)


def load_geometry(path: Path = DRAWING) -> Geometry:
    """Read a geometry.yaml. Raises UserError where it is missing, no YAML, or a length is missing, unknown or not positive."""
    if not path.is_file():
        raise UserError(f"no geometry at {path}: expected a YAML file like {DRAWING}")
    try:
        return TypeAdapter(Geometry).validate_python(yaml.safe_load(path.read_text(encoding="utf-8")))
    except yaml.YAMLError as error:
        raise UserError(f"{path} is not YAML: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise UserError(f"{path}: {where or 'the file'}: {first['msg']}; it holds {first['input']!r}") from None
