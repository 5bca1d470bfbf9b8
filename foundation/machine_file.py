"""A user's machine as one file (machine/1): `--machine` names it; emulator and controller each read their half."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field, PositiveFloat, PositiveInt, ValidationError, field_validator

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed

FILE = "machine.yaml"
MOST_AXES = 12
"""Nodes 1 to 12."""

T = TypeVar("T")


class AxisEntry(Strict):
    """One axis; `drive`: the emulator's half, `motion`: the controller's. `gear`: motor and output turns; `feed` [m a turn]."""

    node_id: int = Field(ge=1, le=127)
    joint: str
    actuator: str
    gear: tuple[PositiveInt, PositiveInt]
    feed: PositiveFloat | None = None
    drive: dict[str, Any]
    motion: dict[str, Any]

    @field_validator("drive", "motion")
    @classmethod
    def _holds_its_own_keys(cls, half: dict[str, Any]) -> dict[str, Any]:
        if both := sorted({*cls.model_fields, "gear_ratio", "motor_inertia"}.intersection(half)):
            raise ValueError(f"{both[0]} belongs beside `drive` and `motion`, or follows from their keys")
        return half


class MachineFile(Strict):
    """machine.yaml. `model`: MJCF of the plant; `nominal`: the controller's (the same, unless told); `effects`: the plant's."""

    schema_: Literal["machine/1"] = Field(alias="schema")
    machine: str
    model: str
    nominal: str | None = None
    effects: str = "effects.json"
    groups: tuple[tuple[str, ...], ...] | None = None
    axes: dict[str, AxisEntry] = Field(min_length=1, max_length=MOST_AXES)


def named_file(name: str) -> Path | None:
    """The file that --machine names by its path, or by that of its folder; None where it is a mere name."""
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        return path
    return path / FILE if path.is_dir() or len(path.parts) > 1 else None


def read_machine_file(path: Path) -> MachineFile:
    """Raises UserError naming the file and the key that is missing or wrong."""
    if not path.is_file():
        raise UserError(f"{path} does not exist; `drivetwin machine new robot.xml --out DIR` makes a machine")
    return typed(MachineFile, read_yaml(path), path)


def checked(path: Path, within: str, make: Callable[[], T]) -> T:
    """What `make` makes of a part of the file. Raises UserError for its first ValidationError, by file and key."""
    try:
        return make()
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join([*filter(None, [within]), *(str(part) for part in first["loc"])]) or "the file"
        raise UserError(f"{path}: {key}: {first['msg'].removeprefix('Value error, ')}") from None
