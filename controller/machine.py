"""The controller's description of a machine (axes.yaml): nodes, gears, travel, speeds, homing, nominal model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from functools import partial
from math import pi
from pathlib import Path

from pydantic import Field, PositiveFloat, PositiveInt, field_validator

from drivetwin.bus.node_ids import check_each_its_own
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.machine_file import AxisEntry, checked, named_file, read_machine_file
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed

MACHINES = Path(__file__).parent / "machines"

POSITION_UNIT = 1e-8
"""User unit of position that the controller scales every drive to [m or rad]: about an encoder increment, +-21 in 32 bits."""


class Homing(Strict):
    """How an axis finds its zero: method (6098h), where its switch stands, speeds and acceleration (joint, SI)."""

    method: int
    switch_position: float
    search_speed: PositiveFloat
    edge_speed: PositiveFloat
    acceleration: PositiveFloat


class Axis(Strict):
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

    @field_validator("travel")
    @classmethod
    def _fits_into_32_bits(cls, travel: tuple[float, float]) -> tuple[float, float]:
        most = POSITION_UNIT * 0x7FFFFFFF
        if max(abs(end) for end in travel) > most:
            raise ValueError(f"{travel[0]:g} to {travel[1]:g} is beyond {most:.4g}, the most in 32 bits of {POSITION_UNIT:g}")
        return travel

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


class Machine(Strict):
    """axes.yaml. `groups` are axes that may be identified at the same time, because they do not act on each other."""

    machine: str
    model: str
    axes: dict[str, Axis]
    groups: tuple[tuple[str, ...], ...]
    directory: Path
    file: str = "axes.yaml"

    @field_validator("axes")
    @classmethod
    def _each_has_its_node(cls, axes: dict[str, Axis]) -> dict[str, Axis]:
        check_each_its_own({name: axis.node_id for name, axis in axes.items()})
        return axes

    def check_axes(self, names: Iterable[str]) -> None:
        """Raise UserError for the first name that is no axis of this machine."""
        if strange := [name for name in names if name not in self.axes]:
            raise UserError(f"machine {self.machine} has no axis {strange[0]!r}, only {', '.join(self.axes)}")

    def beside_the_middle(self, share: float) -> dict[str, float]:
        """Every axis at a share of its travel beside the middle [m or rad]."""
        return {name: sum(axis.travel) / 2.0 + share * (axis.travel[1] - axis.travel[0]) for name, axis in self.axes.items()}

    @property
    def model_path(self) -> Path:
        """The controller's nominal model (MJCF)."""
        return self.directory / self.model

    @property
    def axes_path(self) -> Path:
        """The file that this description was read from."""
        return self.directory / self.file


def available_machines() -> tuple[str, ...]:
    """Names that `load_machine` knows."""
    return tuple(sorted(path.parent.name for path in MACHINES.glob("*/axes.yaml")))


def load_machine(name: str) -> Machine:
    """The controller's description of machine `name`, or of that folder or file (machine/1).

    Raises UserError naming the machines it knows, or the key of axes.yaml that is wrong.
    """
    path = MACHINES / name / "axes.yaml"
    if name not in available_machines():
        if (file := named_file(name)) is not None:
            return _of_file(file)
        known = ", ".join(available_machines())
        raise UserError(f"the controller knows no machine {name!r}; it knows {known}, or give the folder of a machine")
    return typed(Machine, {**read_yaml(path), "directory": path.parent}, path)


def _of_file(path: Path) -> Machine:
    """What a controller may know of it: gears and motion, the nominal model, the rotor by its data sheet."""
    told = read_machine_file(path)
    axes = {name: checked(path, f"axes.{name}.motion", partial(_axis, entry)) for name, entry in told.axes.items()}
    groups = told.groups or tuple((name,) for name in told.axes)
    if strange := {name for group in groups for name in group} - set(axes):
        raise UserError(f"{path}: groups: there is no axis {sorted(strange)[0]!r}; there are {', '.join(axes)}")
    if twice := [name for name, count in Counter(name for group in groups for name in group).items() if count > 1]:
        raise UserError(f"{path}: groups: axis {twice[0]!r} stands in it twice")
    model, places = told.nominal or told.model, {"directory": path.parent, "file": path.name}
    whole = {"machine": told.machine, "model": model, "axes": axes, "groups": groups, **places}
    return checked(path, "", lambda: Machine.model_validate(whole))


def _axis(entry: AxisEntry) -> Axis:
    motor = entry.drive.get("motor")
    both = {"node_id": entry.node_id, "joint": entry.joint, "actuator": entry.actuator, "gear": entry.gear, "feed": entry.feed}
    rotor = motor.get("inertia") if isinstance(motor, dict) else None
    return Axis.model_validate({**entry.motion, **both, "motor_inertia": rotor})
