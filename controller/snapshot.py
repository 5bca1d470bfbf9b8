"""Every object of a live drive by SDO upload: its value, or the abort code with which the drive refused it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from math import isfinite

import canopen
from canopen.objectdictionary import ObjectDictionaryError
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivetwin.controller.dictionary import object_dictionary
from drivetwin.controller.drive_node import place
from drivetwin.controller.link import Link, PumpedNode
from drivetwin.drive_profiles import DriveProfile, ObjectEntry
from drivetwin.drive_profiles.profile import BYTE_TYPES
from drivetwin.drive_profiles.snapshot import Reading, Snapshot
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

TIMED_OUT = 0x05040000
"""SDO protocol timed out (CiA 301, table 22): what is recorded where the drive does not answer for one object."""

SILENT = 3
"""Objects in a row without an answer after which the drive counts as gone."""

Progress = Callable[[int], None]
"""Is told how many objects have been read."""


def take_snapshot(link: Link, node_id: int, profile: DriveProfile, progress: Progress) -> Snapshot:
    """Upload every object that a drive type has from the node with that ID.

    Raises UserError where the drive does not answer at all, or no longer.
    """
    node = PumpedNode(node_id, object_dictionary(profile))
    link.add_node(node)
    readings: list[Reading] = []
    silent = 0
    for entry in profile.objects:
        reading = _read(node, entry)
        silent = silent + 1 if reading.abort == TIMED_OUT else 0
        readings.append(reading)
        if silent == len(readings) or silent == SILENT:
            raise UserError(
                f"node {node_id} does not answer on {link.wire.channel_info} (reading {place(entry.index, entry.subindex)}): "
                f"is the drive powered, and is {node_id} its node-ID?"
            )
        progress(len(readings))
    return Snapshot(profile.name, node_id, tuple(readings))


def _read(node: PumpedNode, entry: ObjectEntry) -> Reading:
    try:
        data = bytes(node.sdo.upload(entry.index, entry.subindex))
    except SdoAbortedError as error:
        return _reading(entry, abort=int(error.code))
    except SdoCommunicationError as error:
        logger.debug("%04Xh:%02X: %s", entry.index, entry.subindex, error)
        return _reading(entry, abort=TIMED_OUT)
    return _reading(entry, data=data, value=_value(node.object_dictionary, entry, data))


def _reading(
    entry: ObjectEntry, *, data: bytes | None = None, value: int | float | str | None = None, abort: int | None = None
) -> Reading:
    kind, access = entry.data_type.name, entry.access.value
    return Reading(entry.index, entry.subindex, entry.name, kind, access, data, value, abort)


def _value(dictionary: canopen.ObjectDictionary, entry: ObjectEntry, data: bytes) -> int | float | str | None:
    """The bytes as a value; None where they have not the type's length, or are no finite number."""
    variable = dictionary.get_variable(entry.index, entry.subindex)
    if variable is None or entry.data_type in BYTE_TYPES:
        return None
    try:
        value = variable.decode_raw(data)
    except ObjectDictionaryError:
        return None
    if isinstance(value, bytes | bytearray) or (isinstance(value, float) and not isfinite(value)):
        return None
    told: int | float | str = value
    return told
