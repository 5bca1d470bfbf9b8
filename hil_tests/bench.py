"""bench.yaml: the machine, its drives and bus, how the controller is started, and the limits that apply here (bench/1)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Literal

import can
import mujoco
from pydantic import Field, FiniteFloat, PositiveFloat, PositiveInt, field_validator

from drivetwin.bus.channel import is_physical
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.emulator.clock import Clock
from drivetwin.emulator.composition import composed
from drivetwin.emulator.effects import PlacedEffect, read_effects
from drivetwin.emulator.machine import Machine, available_machines, load_machine
from drivetwin.emulator.plant import Plant, truth_path
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed
from drivetwin.hil_tests.real_limits import check_narrower, machine_bounds
from drivetwin.hil_tests.task import TaskName
from drivetwin.motion.limits_file import Bounds, read_bounds

EMBEDDED = "embedded"
"""A unix: bus of its own for each case."""

Range = tuple[FiniteFloat, FiniteFloat]
LimitValue = FiniteFloat | dict[str, FiniteFloat] | dict[str, Range]


class ControllerCommand(Strict):
    """How the controller is started, and the tasks that it can do.

    In `command` {task_file}, {bus}, {clock}, {out}, {bench} (the folder of this file) and {python} are filled in, and where the
    drives are real {limits}.
    """

    name: str
    command: list[str] = Field(min_length=1)
    tasks: list[TaskName]


class OrderedPdo(Strict):
    """A PDO as ordered: objects as index:subindex:bits in hexadecimal, hexadecimal and decimal, and the transmission type."""

    objects: list[str] = Field(max_length=8)
    transmission: int = Field(ge=0, le=255)

    @field_validator("objects")
    @classmethod
    def _each_an_object(cls, objects: list[str]) -> list[str]:
        for text in objects:
            mapping_entry(text)
        return objects

    @property
    def entries(self) -> tuple[int, ...]:
        """The entries of 1600h.. or 1A00h.. (CiA 301, 7.5.2.36)."""
        return tuple(mapping_entry(text) for text in self.objects)


class Timeouts(Strict):
    """For controllers that hang. `start` and `silence` are wall-clock seconds; `simulated` is how long a task may take."""

    start: PositiveFloat = 20.0
    silence: PositiveFloat = 20.0
    simulated: PositiveFloat = 300.0


class RealDrives(Strict):
    """The limits file that the controller of real drives is given; `any_bus`: their bus may have any name."""

    limits: Path | None = None
    any_bus: bool = False


class Bench(Strict):
    """bench.yaml, with the file it was read from.

    `noise` is by how much a measured quantity differs from run to run (standard deviation), by its name, for trends. `needs`
    are groups without which nobody is accepted.
    """

    format: Literal["bench/1"]
    machine: str
    profile: str
    model: Path | None = None
    truth: Path | None = None
    drives: Literal["virtual", "real"] = "virtual"
    real: RealDrives = RealDrives()
    bus: str = EMBEDDED
    clock: Literal["sync", "realtime"] = "sync"
    bit_rate: PositiveInt = Field(default=1_000_000, ge=10_000, le=1_000_000)
    bit_timing: bool = False
    cycle: PositiveFloat = 0.001
    seed: int = Field(default=0, ge=0)
    controller: ControllerCommand
    pdo: dict[str, OrderedPdo] = Field(default_factory=dict)
    limits: dict[str, LimitValue] = Field(default_factory=dict)
    noise: dict[str, FiniteFloat | dict[str, FiniteFloat]] = Field(default_factory=dict)
    needs: list[str] = Field(default_factory=list)
    timeouts: Timeouts = Timeouts()
    path: Path

    @field_validator("pdo")
    @classmethod
    def _each_a_pdo(cls, pdos: dict[str, OrderedPdo]) -> dict[str, OrderedPdo]:
        known = [f"{direction} {number}" for direction in ("rpdo", "tpdo") for number in range(1, 5)]
        if unknown := [name for name in pdos if name not in known]:
            raise ValueError(f"{unknown[0]!r} is not a PDO; expected {', '.join(known)}")
        return pdos

    @cached_property
    def virtual(self) -> Machine:
        """The machine."""
        return load_machine(self.machine_place)

    @property
    def machine_place(self) -> str:
        """The machine as a controller finds it: by its name, or one of a user's own by the path of its folder or file."""
        beside = self.path.parent / self.machine
        named = self.machine in available_machines() or not (beside.exists() or len(Path(self.machine).parts) > 1)
        return self.machine if named else str(beside.resolve())

    @property
    def machine_name(self) -> str:
        """What it is called."""
        return self.virtual.machine

    @cached_property
    def drive_type(self) -> DriveProfile:
        """The type of its drives."""
        return load_profile(self.profile)

    @cached_property
    def effects(self) -> tuple[PlacedEffect, ...]:
        """The plant's truth beside its model."""
        joints = {name: axis.joint for name, axis in self.virtual.axes.items()}
        return composed(read_effects(self.effects_path), (), self.model_path, joints).effects

    @property
    def effects_path(self) -> Path:
        """The file that it stands in."""
        return truth_path(self.virtual, None if self.truth is None else self.path.parent / self.truth)

    @property
    def model_path(self) -> Path | None:
        """The plant's model in the place of the machine's own, which stands beside the bench."""
        return None if self.model is None else self.path.parent / self.model

    def virtual_machine(self, clock: Clock, transmit: Callable[[can.Message], None]) -> VirtualMachine:
        """The machine with its drives, before they are switched on."""
        plant = Plant(self.virtual, self.effects, self.model_path)
        return VirtualMachine(self.virtual, self.drive_type, self.effects, clock, self.seed, transmit, plant=plant)

    @cached_property
    def units(self) -> dict[str, str]:
        """`m` or `rad` of each axis."""
        model = mujoco.MjModel.from_xml_path(str(self.virtual.model_path))
        types = {name: model.joint(axis.joint).type[0] for name, axis in self.virtual.axes.items()}
        return {name: "m" if kind == mujoco.mjtJoint.mjJNT_SLIDE else "rad" for name, kind in types.items()}

    @property
    def limits_path(self) -> Path | None:
        """The limits file of real drives, which stands beside the bench."""
        return None if self.real.limits is None else self.path.parent / self.real.limits

    @cached_property
    def real_limits(self) -> Mapping[str, Bounds]:
        """What real axes may do, by their names; nothing where they are virtual. Raises UserError as `read_bounds`."""
        return {} if self.limits_path is None else read_bounds(self.limits_path, self.axes)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes, in the machine's order."""
        return tuple(self.virtual.axes)

    def limit(self, name: str) -> LimitValue:
        """The limit of that name. Raises UserError where this bench has none."""
        if name not in self.limits:
            raise UserError(f"{self.path}: limits: there is no {name!r}; this bench has {', '.join(self.limits) or 'none'}")
        return self.limits[name]


class UnmeantError(UserError):
    """A bench of real drives, sound in all else, of which nobody has said that they are meant."""

    def __init__(self, bench: Bench) -> None:
        super().__init__(
            f"{bench.path}: its drives are real, and a machine will move: add --real to `drivetwin accept`, once it is clear"
        )
        self.bench = bench


def read_bench(path: Path, real: bool = False, changes: Mapping[str, object] | None = None) -> Bench:
    """Read and check a bench; `changes` are keys whose values replace those of the file.

    Raises UserError naming the file and the key for what is missing, unknown or wrong, a machine, drive type or truth that is
    not there, and a limit of an axis that the machine has not. A bench of real drives is refused unless its limits are narrower
    than the machine's, and as UnmeantError unless `real` says that somebody means it; one of virtual drives, on a bus that may
    have real ones.
    """
    bench = typed(Bench, {**read_yaml(path), **(changes or {}), "path": path.absolute()}, path)
    if bench.drives == "virtual":
        _check_virtual(bench, path, real)
    axes, _profile, _effects = bench.axes, bench.drive_type, bench.effects
    for name, value in bench.limits.items():
        if isinstance(value, dict) and (unknown := sorted(set(value) - set(axes))):
            known = ", ".join(axes)
            raise UserError(f"{path}: limits.{name}: machine {bench.machine_name} has no axis {unknown[0]!r}, only {known}")
    if bench.drives == "real":
        _check_real(bench, path)
        if not real:
            raise UnmeantError(bench)
    return bench


def _check_virtual(bench: Bench, path: Path, real: bool) -> None:
    if is_physical(bench.bus):
        raise UserError(
            f"{path}: bus: {bench.bus} may have real drives, and the suite brings virtual ones with the same node-IDs; "
            f"choose {EMBEDDED}, vcan0 or ws://127.0.0.1:PORT"
        )
    if real:
        raise UserError(f"{path}: --real is for a bench whose file says drives: real, and its drives are virtual")
    if "real" in bench.model_fields_set:
        raise UserError(f"{path}: real: is for drives: real, and these are virtual")


def _check_real(bench: Bench, path: Path) -> None:
    """All that has to hold before axes move that can hurt somebody, but that somebody is there."""
    if bench.bus == EMBEDDED:
        raise UserError(f"{path}: bus: {EMBEDDED} is made for a case, and real drives are on none; write for example can0")
    if not (is_physical(bench.bus) or bench.real.any_bus):
        raise UserError(
            f"{path}: bus: {bench.bus} is not named like a physical bus (can0); if it is meant, add any_bus: true to real"
        )
    if bench.clock != "realtime":
        raise UserError(f"{path}: clock: real drives have their own clock; write clock: realtime")
    if bench.bit_timing or bench.truth is not None or bench.model is not None:
        wrong = "bit_timing: their wire" if bench.bit_timing else "truth: their plant" if bench.truth else "model: their plant"
        raise UserError(f"{path}: {wrong} is not modelled where drives are real; leave it out")
    if bench.limits_path is None:
        raise UserError(f"{path}: real.limits: name the file of travel, speed and torque that this machine may be driven at")
    if not any("{limits}" in part for part in bench.controller.command):
        raise UserError(f"{path}: controller.command: only the controller can keep to real.limits; give it {{limits}}")
    check_narrower(bench.real_limits, machine_bounds(bench.virtual), f"machine {bench.machine_name}", bench.limits_path)
    check_narrower(bench.real_limits, _told_bounds(bench), f"limits in {path.name}", bench.limits_path)


def _told_bounds(bench: Bench) -> dict[str, Bounds]:
    """Travel, speed and torque that the bench's `limits` allow. Raises UserError for one that is not there."""
    travel, speed, torque = (bench.limit(name) for name in ("travel", "speed", "torque"))
    found = {}
    for axis in bench.axes:
        match _of(travel, axis), _of(speed, axis), _of(torque, axis):
            case (float(low), float(high)), float(fastest), float(hardest):
                found[axis] = Bounds((low, high), fastest, hardest)
            case _:
                raise UserError(f"{bench.path}: limits: real drives need travel [lowest, highest], speed and torque of {axis}")
    return found


def _of(value: LimitValue, axis: str) -> object:
    return value.get(axis) if isinstance(value, dict) else value


def mapping_entry(text: str) -> int:
    """An entry of a PDO mapping: 6040:00:16 is 60400010h. Raises ValueError where the text is none."""
    try:
        index, subindex, bits = text.removesuffix("h").split(":")
        return int(index, 16) << 16 | int(subindex, 16) << 8 | int(bits)
    except ValueError:
        raise ValueError(f"{text!r} is not an object of a PDO; write index:subindex:bits, for example 6040:00:16") from None
