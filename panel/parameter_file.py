"""Values of a drive's objects from a file that a person hands in: an EDS or DCF (CiA 306-1), or a snapshot/1."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from drivetwin.drive_profiles import Access, DataType, ObjectEntry
from drivetwin.drive_profiles.eds_reader import EdsFile, EdsObject, parse_eds, parse_number
from drivetwin.drive_profiles.eds_values import number_of
from drivetwin.drive_profiles.profile import BITS, BYTE_TYPES
from drivetwin.drive_profiles.snapshot import parse_snapshot
from drivetwin.foundation.errors import UserError
from drivetwin.panel.pdo_reading import Address
from drivetwin.panel.values import pack

COMMUNICATION = range(0x1000, 0x2000)
"""Objects of CiA 301: identifiers, PDOs, heartbeats. The master of a bus sets these, each in its own order."""

COMMANDS = frozenset({
    0x6040, 0x6042, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60B8, 0x60C1, 0x60FE, 0x60FF,
})  # fmt: skip
"""What makes a drive do something (CiA 402-2): controlword, mode, set-points, offsets, touch probe, outputs."""


@dataclass(frozen=True)
class ParameterFile:
    """What a file says of a drive: bytes as they stand on the bus, and how many of its values are of no object of the drive."""

    values: Mapping[Address, bytes]
    strange: int


def read_parameters(name: str, text: str, entries: Mapping[Address, ObjectEntry], node_id: int) -> ParameterFile:
    """The values of `text`, a file called `name`, for the drive `node_id` that has these objects.

    A DCF counts with its ParameterValue, else the DefaultValue. Raises UserError for what is no such file, or for no value.
    """
    path = Path(name)
    found = _of_snapshot(path, text) if text.lstrip().startswith("{") else _of_eds(parse_eds(path, text), entries, node_id)
    values = {address: data for address, data in found.items() if address in entries}
    if not values:
        raise UserError(f"{name} has no value of an object that this drive has; expected its EDS, a DCF or a snapshot")
    return ParameterFile(values, len(found) - len(values))


def is_parameter(entry: ObjectEntry) -> bool:
    """Whether a file may set it: what is written, and neither commands the drive nor belongs to the master of the bus."""
    return entry.access is Access.RW and entry.index not in COMMUNICATION and entry.index not in COMMANDS


def _of_snapshot(path: Path, text: str) -> dict[Address, bytes]:
    readings = parse_snapshot(path, text).readings
    return {(reading.index, reading.subindex): reading.data for reading in readings if reading.data is not None}


def _of_eds(file: EdsFile, entries: Mapping[Address, ObjectEntry], node_id: int) -> dict[Address, bytes]:
    found: dict[Address, bytes] = {}
    for told in file.objects:
        entry = entries.get((told.index, told.subindex))
        # of an object that the drive does not have, only that there is a value counts
        data = (told.value or told.default).encode() or None if entry is None else _bytes(file, told, node_id, entry.data_type)
        if data is not None:
            found[told.index, told.subindex] = data
    return found


def _bytes(file: EdsFile, told: EdsObject, node_id: int, data_type: DataType) -> bytes | None:
    """What it would be on the bus; None where the file has no value, or none of its type."""
    text = told.value or told.default
    if not text:
        return None
    if data_type in BYTE_TYPES:
        try:
            return bytes.fromhex(text)
        except ValueError:
            return None
    if data_type not in BITS:
        plain = text.strip('"')
        return plain.encode("utf-16-le") if data_type is DataType.USTR else plain.encode("latin-1", "replace")
    number = number_of(text, data_type)
    try:
        return None if number is None else pack(data_type, number + _moved(file, told, text, node_id))
    except OverflowError:
        return None


def _moved(file: EdsFile, told: EdsObject, text: str, node_id: int) -> int:
    """What is to be added on this node: its ID to a $NODEID, the difference where a DCF is of another node."""
    written, default = parse_number(text), parse_number(told.default)
    if written is not None and written.node_relative:
        return node_id
    if told.value and default is not None and default.node_relative and file.node_id is not None:
        return node_id - file.node_id
    return 0
