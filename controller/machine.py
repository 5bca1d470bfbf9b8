"""The controller's own description of a machine (axes.yaml): nodes, gears, travel, speeds, how to home, its nominal model."""

from __future__ import annotations

from math import pi
from pathlib import Path

import yaml
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt, ValidationError, field_validator

from drivetwin.bus.node_ids import check_each_its_own
from drivetwin.foundation.errors import UserError

MACHINES = Path(__file__).parent / "machines"

POSITION_UNIT = 1e-8
"""User unit of position that the controller scales every drive to [m or rad]: about an encoder increment, +-21 in 32 bits."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Homing(_Strict):
    """How an axis finds its zero: method (6098h), where its switch stands, speeds and acceleration (joint, SI)."""

    method: int
    switch_position: float
    search_speed: PositiveFloat
    edge_speed: PositiveFloat
    acceleration: PositiveFloat


class Axis(_Strict):
    """One axis, joint side, SI: m, rad. `feed` is the joint's travel a turn of the gear's output, 2 pi on a revolute axis.

    `motor_inertia` is the rotor's [kg·m²], None where no data sheet tells it.
    """

    node_id: int = Field(ge=1, le=127)
    joint: str
    actuator: str
    gear: tuple[PositiveInt, PositiveInt]
    feed: PositiveFloat | None = None
    motor_inertia: PositiveFloat | None = None
    travel: tuple[float, float]
    rest: float
    max_speed: PositiveFloat
    max_acceleration: PositiveFloat
    homing: Homing

    @property
    def prismatic(self) -> bool:
        """Whether the axis moves along a line."""
        return self.feed is not None

    @property
    def feed_constant(self) -> float:
        """Joint travel a turn of the gear's output shaft [m or rad]."""
        return self.feed if self.feed is not None else 2.0 * pi

    @property
    def gear_ratio(self) -> float:
        """Motor angle per joint travel [rad/rad or rad/m]."""
        return self.gear[0] / self.gear[1] * 2.0 * pi / self.feed_constant


class Machine(_Strict):
    """axes.yaml. `groups` are axes that may be identified at the same time, because they do not act on each other."""

    machine: str
    model: str
    axes: dict[str, Axis]
    groups: tuple[tuple[str, ...], ...]
    directory: Path

    @field_validator("axes")
    @classmethod
    def _each_has_its_node(cls, axes: dict[str, Axis]) -> dict[str, Axis]:
        check_each_its_own({name: axis.node_id for name, axis in axes.items()})
        return axes

    @property
    def model_path(self) -> Path:
        """The controller's nominal model (MJCF)."""
        return self.directory / self.model

    @property
    def axes_path(self) -> Path:
        """The file that this description was read from."""
        return self.directory / "axes.yaml"


def available_machines() -> tuple[str, ...]:
    """Names that `load_machine` knows."""
    return tuple(sorted(path.parent.name for path in MACHINES.glob("*/axes.yaml")))


def load_machine(name: str) -> Machine:
    """The controller's description of machine `name`.

    Raises UserError naming the machines it knows, or the key of axes.yaml that is wrong.
    """
    path = MACHINES / name / "axes.yaml"
    if not path.is_file():
        raise UserError(f"the controller knows no machine {name!r}; it knows {', '.join(available_machines())}")
    try:
        return Machine(**yaml.safe_load(path.read_text(encoding="utf-8")), directory=path.parent)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise UserError(f"{path}: {where}: {first['msg'].removeprefix('Value error, ')}") from None
