"""bench.yaml: the machine, its drives and bus, how the controller is started, and the limits that apply here (bench/1)."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Literal

from pydantic import Field, FiniteFloat, PositiveFloat, PositiveInt, field_validator

from drive_profiles import DriveProfile, load_profile
from drivetwin.bus import is_copper
from drivetwin.errors import UserError
from emulator.effects import PlacedEffect, read_effects
from emulator.machine import Machine, load_machine
from emulator.plant import truth_path
from hil_tests.strict import Strict, read_yaml, typed
from hil_tests.task import TaskName

EMBEDDED = "embedded"
"""A unix: bus of its own for each case."""

Range = tuple[FiniteFloat, FiniteFloat]
LimitValue = FiniteFloat | dict[str, FiniteFloat] | dict[str, Range]


class ControllerCommand(Strict):
    """How the controller is started, and the tasks that it can do.

    In `command` {task_file}, {bus}, {clock}, {out}, {bench} (the folder of this file) and {python} are filled in.
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


class Bench(Strict):
    """bench.yaml, with the file it was read from.

    `noise` is by how much a measured quantity differs from run to run (standard deviation), by its name, for trends.
    """

    format: Literal["bench/1"]
    machine: str
    profile: str
    truth: Path | None = None
    bus: str = EMBEDDED
    clock: Literal["sync", "realtime"] = "sync"
    bit_rate: PositiveInt = Field(default=1_000_000, ge=10_000, le=1_000_000)
    copper: bool = False
    cycle: PositiveFloat = 0.001
    seed: int = Field(default=0, ge=0)
    controller: ControllerCommand
    pdo: dict[str, OrderedPdo] = Field(default_factory=dict)
    limits: dict[str, LimitValue] = Field(default_factory=dict)
    noise: dict[str, FiniteFloat | dict[str, FiniteFloat]] = Field(default_factory=dict)
    timeouts: Timeouts = Timeouts()
    path: Path

    @field_validator("pdo")
    @classmethod
    def _each_a_pdo(cls, pdos: dict[str, OrderedPdo]) -> dict[str, OrderedPdo]:
        known = [f"{direction} {number}" for direction in ("rpdo", "tpdo") for number in range(1, 5)]
        if unknown := [name for name in pdos if name not in known]:
            raise ValueError(f"{unknown[0]!r} is no PDO; expected {', '.join(known)}")
        return pdos

    @cached_property
    def virtual(self) -> Machine:
        """The machine."""
        return load_machine(self.machine)

    @cached_property
    def drive_type(self) -> DriveProfile:
        """The type of its drives."""
        return load_profile(self.profile)

    @cached_property
    def effects(self) -> tuple[PlacedEffect, ...]:
        """The plant's truth."""
        given = None if self.truth is None else self.path.parent / self.truth
        return read_effects(truth_path(self.virtual, given))

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes, in the machine's order."""
        return tuple(self.virtual.axes)

    def limit(self, name: str) -> LimitValue:
        """The limit of that name. Raises UserError where this bench has none."""
        if name not in self.limits:
            raise UserError(f"{self.path}: limits: there is no {name!r}; this bench has {', '.join(self.limits) or 'none'}")
        return self.limits[name]


def read_bench(path: Path) -> Bench:
    """Read and check a bench.

    Raises UserError naming the file and the key for what is missing, unknown or wrong, a bus that may have real drives, a
    machine, drive type or truth that is not there, and a limit of an axis that the machine has not.
    """
    bench = typed(Bench, {**read_yaml(path), "path": path.absolute()}, path)
    if is_copper(bench.bus):
        raise UserError(
            f"{path}: bus: {bench.bus} may have real drives, and the suite brings virtual ones with the same node-IDs; "
            f"choose {EMBEDDED}, vcan0 or ws://127.0.0.1:PORT"
        )
    axes, _profile, _effects = bench.axes, bench.drive_type, bench.effects
    for name, value in bench.limits.items():
        if isinstance(value, dict) and (unknown := sorted(set(value) - set(axes))):
            known = ", ".join(axes)
            raise UserError(f"{path}: limits.{name}: machine {bench.machine} has no axis {unknown[0]!r}, only {known}")
    return bench


def mapping_entry(text: str) -> int:
    """An entry of a PDO mapping: 6040:00:16 is 60400010h. Raises ValueError where the text is none."""
    try:
        index, subindex, bits = text.removesuffix("h").split(":")
        return int(index, 16) << 16 | int(subindex, 16) << 8 | int(bits)
    except ValueError:
        raise ValueError(f"{text!r} is no object of a PDO; write index:subindex:bits, for example 6040:00:16") from None
