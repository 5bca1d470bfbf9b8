"""Loads a real drive's dictionary, read by `drivetwin snapshot`, as the stored parameters of a virtual drive."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from drivetwin.drive_profiles.snapshot import Reading, Snapshot
from drivetwin.emulator.canopen.abort_codes import SdoAbort
from drivetwin.emulator.canopen.data_types import decode
from drivetwin.emulator.canopen.device import PDO_COUNT
from drivetwin.emulator.canopen.object_dictionary import COMMUNICATION_AREA, ObjectDictionary, Variable
from drivetwin.emulator.canopen.pdo_mapping import MappingRule, maps_to_rpdo, maps_to_tpdo, parse_mapping
from drivetwin.emulator.drive.drive import Drive
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

COMMANDS = frozenset({0x6040, 0x6042, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FE, 0x60FF})
"""Commands of the moment at which the snapshot was taken. No drive stores them, and one that did would jump when enabled."""


def load_snapshot(drives: Sequence[Drive], snapshot: Snapshot, path: Path) -> None:
    """Store what the snapshot holds in the drive with its node-ID, before power-on.

    Writable objects and constants are taken; measured values, and commands (`COMMANDS`), are the virtual drive's own.
    Raises UserError where no drive has that node-ID, or a value does not go with its object.
    """
    drive = next((drive for drive in drives if drive.device.node_id == snapshot.node_id), None)
    if drive is None:
        nodes = ", ".join(str(drive.device.node_id) for drive in drives)
        raise UserError(f"{path} is of node {snapshot.node_id}; this machine's drives are the nodes {nodes}")
    unknown = [reading for reading in snapshot.readings if (reading.index, reading.subindex) not in drive.dictionary]
    if unknown:
        logger.warning(
            "%s: the drive type %s has no %s; left out", path, drive.profile.name, ", ".join(map(_place, unknown[:8]))
        )
    for reading in snapshot.readings:
        if reading not in unknown:
            _store(drive.dictionary[reading.index, reading.subindex], reading, path)
    _take_effect(drive, path)


def is_stored(variable: Variable) -> bool:
    """Whether a drive keeps the object's value, rather than measures it or is told it anew each time."""
    kept = variable.access.writable or variable.access == "const" or variable.index in COMMUNICATION_AREA
    return kept and variable.on_read is None and variable.index not in COMMANDS


def _store(variable: Variable, reading: Reading, path: Path) -> None:
    if reading.data is None or not is_stored(variable):
        return
    where = f"{path}: {_place(reading)} {reading.name}"
    if reading.data_type != variable.data_type.name:
        raise UserError(f"{where} is {reading.data_type}; this drive type has it as {variable.data_type.name}: choose another")
    if variable.size is not None and len(reading.data) != variable.size:
        raise UserError(f"{where}: {len(reading.data)} bytes; {reading.data_type} has {variable.size}: correct the EDS")
    value = decode(variable.data_type, reading.data)
    try:
        variable.check(value)
    except SdoAbort as abort:
        raise UserError(f"{where} = {value} is outside what this drive type allows: {abort}") from None
    variable.commission(value)


def _take_effect(drive: Drive, path: Path) -> None:
    """As after a reset of the node. A mapping that the drive cannot have would silently map nothing, so it is refused."""
    for first, rule in ((0x1600, maps_to_rpdo), (0x1A00, maps_to_tpdo)):
        for index in range(first, first + PDO_COUNT):
            _check_mapping(drive.dictionary, index, rule, path)
    for reset in drive.device.on_reset_application:
        reset()


def _check_mapping(dictionary: ObjectDictionary, index: int, rule: MappingRule, path: Path) -> None:
    try:
        entries = [dictionary.find(index, subindex).number for subindex in range(1, dictionary[index].number + 1)]
        parse_mapping(dictionary, entries, rule)
    except SdoAbort as abort:
        raise UserError(f"{path}: the PDO mapping {index:04X}h does not go with this drive type: {abort}") from None


def _place(reading: Reading) -> str:
    return f"{reading.index:04X}h:{reading.subindex:02X}"
