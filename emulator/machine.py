"""A machine's configuration: its MuJoCo model, and the motor side of each axis (machine.yaml)."""

from __future__ import annotations

from functools import partial
from math import pi
from pathlib import Path
from typing import Self

from pydantic import Field, PositiveFloat, field_validator, model_validator

from drivetwin.bus.node_ids import check_each_its_own
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.machine_file import AxisEntry, checked, named_file, read_machine_file
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed

MACHINES = Path(__file__).parent / "machines"


class Motor(Strict):
    """Motor shaft and power stage.

    Rated torque [N·m], which 6076h holds in mN·m and 32 bits; peak torque [N·m], at least as much; rotor inertia [kg·m²],
    holding brake torque [N·m] (0: no brake), thermal time constant of the I2t model [s], nominal DC link voltage [V],
    current at rated torque [A], speed that the rotor bears [rad/s] (None: any).
    """

    rated_torque: float = Field(ge=0.001, le=4e6)
    peak_torque: PositiveFloat
    inertia: PositiveFloat
    holding_brake: float = Field(default=0.0, ge=0.0)
    thermal_time_constant: PositiveFloat = 10.0
    dc_link_voltage: PositiveFloat = 325.0
    rated_current: PositiveFloat = 2.0
    max_speed: PositiveFloat | None = None

    @model_validator(mode="after")
    def _peaks_above_its_rating(self) -> Self:
        if self.peak_torque < self.rated_torque:
            raise ValueError(f"peak_torque is {self.peak_torque:g}, less than rated_torque, {self.rated_torque:g}")
        return self


class Encoder(Strict):
    """Encoder on the motor shaft; its index pulse comes once a turn, at `index_angle` [rad]."""

    increments_per_revolution: int = Field(ge=1, le=0x7FFFFFFF)
    index_angle: float = 0.0


class CurrentSensor(Strict):
    """Torque-producing current as measured, in fractions of rated torque: noise (rms at the servo rate) and resolution."""

    noise: float = Field(ge=0.0)
    resolution: PositiveFloat


class Loops(Strict):
    """Commissioned gains: 1/s; N·m·s/rad or N·s/m on the joint side; s (None: a P velocity loop); 0..1; Hz."""

    position_gain: PositiveFloat
    velocity_gain: PositiveFloat
    integral_time: PositiveFloat | None
    velocity_feedforward: float = Field(ge=0.0, le=1.0)
    velocity_filter_hz: PositiveFloat


class Ends(Strict):
    """Two joint positions [rad or m]."""

    negative: float
    positive: float

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        """Raises ValueError where the negative end is not below the positive one; the comparison refuses NaN, too."""
        if not self.negative < self.positive:
            raise ValueError(f"negative is {self.negative:g} and positive {self.positive:g}; the negative one must be less")
        return self


class LimitSwitches(Ends):
    """Beyond these positions the negative and the positive limit switch are actuated."""


class HomeSwitch(Ends):
    """Between these positions the home switch is actuated."""


class Axis(Strict):
    """One motor-driven joint. `gear_ratio` is motor turns a joint turn, or rad/m on a prismatic joint."""

    node_id: int = Field(ge=1, le=127)
    joint: str
    actuator: str
    gear_ratio: PositiveFloat
    motor: Motor
    encoder: Encoder
    current_sensor: CurrentSensor
    current_loop_time_constant: PositiveFloat
    loops: Loops
    limit_switches: LimitSwitches
    home_switch: HomeSwitch | None = None
    power_on_position: float


class Machine(Strict):
    """machine.yaml, with the directory it stands in."""

    machine: str
    model: str
    effects: str = "effects.json"
    axes: dict[str, Axis]
    directory: Path

    @field_validator("axes")
    @classmethod
    def _each_has_its_node(cls, axes: dict[str, Axis]) -> dict[str, Axis]:
        check_each_its_own({name: axis.node_id for name, axis in axes.items()})
        return axes

    @property
    def model_path(self) -> Path:
        """The MJCF file of the plant."""
        return self.directory / self.model

    @property
    def effects_path(self) -> Path:
        """The machine's own true effects (effects/1)."""
        return self.directory / self.effects

    @property
    def built_in(self) -> bool:
        """Whether it is one of this package, whose model is a plant as it stands."""
        return self.directory.parent == MACHINES


def available_machines() -> tuple[str, ...]:
    """Names that `load_machine` knows."""
    return tuple(sorted(path.parent.name for path in MACHINES.glob("*/machine.yaml")))


def load_machine(name: str) -> Machine:
    """The machine of that name, or of that folder or file (machine/1).

    Raises UserError naming the known machines, or the key of machine.yaml that is wrong.
    """
    path = MACHINES / name / "machine.yaml"
    if name not in available_machines():
        if (file := named_file(name)) is not None:
            return _of_file(file)
        known = ", ".join(available_machines())
        raise UserError(f"unknown machine {name!r}; known are {known}, or give the folder of a machine")
    return typed(Machine, {**read_yaml(path), "directory": path.parent}, path)


def _of_file(path: Path) -> Machine:
    told = read_machine_file(path)
    axes = {name: checked(path, f"axes.{name}.drive", partial(_axis, entry)) for name, entry in told.axes.items()}
    return checked(
        path,
        "",
        lambda: Machine(machine=told.machine, model=told.model, effects=told.effects, axes=axes, directory=path.parent),
    )


def _axis(entry: AxisEntry) -> Axis:
    feed = 2.0 * pi if entry.feed is None else entry.feed
    both = {"node_id": entry.node_id, "joint": entry.joint, "actuator": entry.actuator}
    return Axis.model_validate({**entry.drive, **both, "gear_ratio": entry.gear[0] / entry.gear[1] * 2.0 * pi / feed})
