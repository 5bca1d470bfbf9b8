"""The contents of a live drive's object dictionary: the file that `drivetwin snapshot` writes and `drivetwin emulate` loads."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import provenance, write_json
from drivetwin.foundation.text_files import parse_json

SCHEMA = "snapshot/1"


@dataclass(frozen=True)
class Reading:
    """What an SDO upload of one object brought: its bytes, or the abort code where the drive refused (CiA 301, table 22).

    `value` are the bytes as the type has them, for a reader's eye; None where they are no number or text of it.
    """

    index: int
    subindex: int
    name: str
    data_type: str
    access: str
    data: bytes | None
    value: int | float | str | None
    abort: int | None


@dataclass(frozen=True)
class Snapshot:
    """Every object of one node, of a drive type."""

    profile: str
    node_id: int
    readings: tuple[Reading, ...]


def write_snapshot(path: Path, snapshot: Snapshot, inputs: Iterable[Path]) -> None:
    """Write a snapshot as JSON; `inputs` are the files that said which objects to read."""
    payload: dict[str, Any] = {
        "schema": SCHEMA,
        **provenance(0, inputs),
        "profile": snapshot.profile,
        "node": snapshot.node_id,
        "objects": [_to_json(reading) for reading in snapshot.readings],
    }
    write_json(path, payload)


def read_snapshot(path: Path) -> Snapshot:
    """Read a snapshot. Raises UserError naming the key that is wrong."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UserError(f"{path} does not exist; expected a file of: drivetwin snapshot --out {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{path} cannot be read as a snapshot: {error}; take one with: drivetwin snapshot") from None
    return parse_snapshot(path, text)


def parse_snapshot(path: Path, text: str) -> Snapshot:
    """Read the text of a snapshot; `path` is what messages call it. Raises UserError as `read_snapshot`."""
    try:
        told = _File.model_validate(parse_json(text))
    except json.JSONDecodeError as error:
        raise UserError(f"{path} cannot be read as a snapshot: {error}; take one with: drivetwin snapshot") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise UserError(f"{path}: {where or 'the file'}: {first['msg']}; expected a file of: drivetwin snapshot") from None
    return Snapshot(told.profile, told.node, tuple(_from_json(entry) for entry in told.objects))


def _to_json(reading: Reading) -> dict[str, Any]:
    head = {
        "index": f"{reading.index:04X}",
        "sub": f"{reading.subindex:02X}",
        "name": reading.name,
        "type": reading.data_type,
        "access": reading.access,
    }
    if reading.data is None:
        return {**head, "abort": f"{reading.abort or 0:08X}"}
    return {**head, "data": reading.data.hex(), "value": reading.value}


def _from_json(entry: _Object) -> Reading:
    return Reading(entry.index, entry.sub, entry.name, entry.type, entry.access, entry.data, entry.value, entry.abort)


def _hexadecimal(value: object) -> object:
    return int(value, 16) if isinstance(value, str) else value


def _hexadecimal_bytes(value: object) -> object:
    return bytes.fromhex(value) if isinstance(value, str) else value


_Hexadecimal = Annotated[int, BeforeValidator(_hexadecimal)]


class _Object(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    index: _Hexadecimal = Field(ge=0x1000, le=0xFFFF)
    sub: _Hexadecimal = Field(ge=0, le=0xFF)
    name: str
    type: str
    access: str
    data: Annotated[bytes, BeforeValidator(_hexadecimal_bytes)] | None = None
    value: int | float | str | None = None
    abort: _Hexadecimal | None = None


class _File(BaseModel):
    model_config = ConfigDict(frozen=True)

    schema_: Literal["snapshot/1"] = Field(alias="schema")
    profile: str
    node: int = Field(ge=1, le=127)
    objects: list[_Object] = Field(min_length=1)
