"""What a drive keeps without power: one file per drive, always completely old or completely new."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.text_files import parse_json

SCHEMA = "parameters/1"

Address = tuple[int, int]
Values = Mapping[Address, bytes]


class Group(StrEnum):
    """Objects that are stored and restored together (CiA 301, 7.5.2.13)."""

    COMMUNICATION = "communication"
    APPLICATION = "application"


class ParameterStore:
    """Stored values of one drive by group, as bytes by address, and what LSS configured.

    The file is read once; `replace` and `configure` write it at once and whole. Raises UserError where the file is there but
    is not such a file, OSError where it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._groups: dict[Group, dict[Address, bytes]] = {group: {} for group in Group}
        self._lss: dict[str, int] = {}
        self._read()

    def values(self, group: Group) -> Values:
        """The stored values of a group; none where it was never stored, or its defaults are restored."""
        return self._groups[group]

    @property
    def lss(self) -> Mapping[str, int]:
        """What LSS stored: `node_id` and `bit_timing`, or nothing."""
        return self._lss

    def replace(self, groups: Mapping[Group, Values]) -> None:
        """Store the values of these groups in place of the older ones; the other groups stay."""
        changed = self._groups | {group: dict(values) for group, values in groups.items()}
        self._write(changed, self._lss)
        self._groups = changed

    def configure(self, node_id: int, bit_timing: int) -> None:
        """Store what LSS configured."""
        changed = {"node_id": node_id, "bit_timing": bit_timing}
        self._write(self._groups, changed)
        self._lss = changed

    def _write(self, groups: Mapping[Group, Values], lss: Mapping[str, int]) -> None:
        """Write a file beside, make sure that it is on the disk, and let it take the place of the old one in one step."""
        payload = {"schema": SCHEMA, **{group.value: _as_text(values) for group, values in groups.items()}, "lss": dict(lss)}
        self._path.parent.mkdir(parents=True, exist_ok=True)
        part = self._path.with_name(f".{self._path.name}.part")
        with part.open("w", encoding="utf-8") as stream:
            json.dump(payload, stream, indent=1)
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(self._path)
        directory = os.open(self._path.parent, os.O_RDONLY)
        try:
            os.fsync(directory)
        finally:
            os.close(directory)

    def _read(self) -> None:
        try:
            text = self._path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return
        except (OSError, UnicodeDecodeError) as error:
            raise UserError(f"{self._path}: not readable as stored parameters: {error}") from None
        try:
            payload = parse_json(text)
            if payload["schema"] != SCHEMA:
                raise ValueError(f"schema {payload['schema']!r}, expected {SCHEMA!r}")
            self._groups = {group: _from_text(payload[group.value]) for group in Group}
            self._lss = _lss(payload["lss"])
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise UserError(f"{self._path}: no stored parameters: {error}; remove the file to start from defaults") from None


def _as_text(values: Values) -> dict[str, str]:
    return {f"{index:04X}:{subindex:02X}": data.hex().upper() for (index, subindex), data in sorted(values.items())}


def _from_text(values: dict[str, Any]) -> dict[Address, bytes]:
    return {_address(key): bytes.fromhex(data) for key, data in values.items()}


def _lss(values: dict[str, Any]) -> dict[str, int]:
    if not values:
        return {}
    node_id = int(values["node_id"])
    if node_id not in (*range(1, 128), 255):
        raise ValueError(f"node_id {node_id}, expected 1..127, or 255 for none")
    return {"node_id": node_id, "bit_timing": int(values["bit_timing"])}


def _address(text: str) -> Address:
    index, subindex = text.split(":")
    return int(index, 16), int(subindex, 16)
