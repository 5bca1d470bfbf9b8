"""All parameters of a drive: saved as a DCF, and written back from a file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from drivetwin.drive_profiles import DataType, ObjectEntry
from drivetwin.drive_profiles.eds_writer import Configured, dcf_text
from drivetwin.drive_profiles.profile import BITS
from drivetwin.foundation.errors import UserError
from drivetwin.panel.door import ObjectRefusedError
from drivetwin.panel.node_watch import STATUSWORD, NodeWatch
from drivetwin.panel.parameter_file import ParameterFile, is_parameter
from drivetwin.panel.power_states import PowerState, power_state
from drivetwin.panel.values import Value, decode, limits

POWERED = frozenset({PowerState.OPERATION_ENABLED, PowerState.QUICK_STOP_ACTIVE, PowerState.FAULT_REACTION_ACTIVE})
"""States in which the drive function is enabled: gears and limits of a moving axis are not changed all at once."""


@dataclass(frozen=True)
class Restored:
    """What became of a file's values: how many were written, stood there already, are no parameters; and what was refused."""

    written: int
    same: int
    left_out: int
    refused: tuple[str, ...]


def dcf_name(node: NodeWatch) -> str:
    """What the DCF of a drive is saved as."""
    plain = "".join(letter if letter.isalnum() else "-" for letter in node.name)
    return f"{plain}-{node.node_id}.dcf"


def saved(node: NodeWatch) -> str:
    """The DCF of a drive as it stands, without what it refuses. Raises UserError where it does not answer."""
    return dcf_text(node.profile, dcf_name(node), Configured(node.node_id, node.name, dict(_read(node))))


def _read(node: NodeWatch) -> Iterator[tuple[tuple[int, int], Value]]:
    for address, entry in sorted(node.entries.items()):
        if not entry.access.readable or entry.data_type is DataType.DOMAIN:
            continue
        with suppress(ObjectRefusedError):
            value = decode(entry.data_type, node.read(*address))
            if value is not None:
                yield address, value


def restore(node: NodeWatch, file: ParameterFile) -> Restored:
    """Write what differs, in the order of the addresses, and read it back.

    A value that the drive refuses, or takes as another one, does not stop the others. Raises UserError where nothing can be
    written: while the drive has power, or where it does not answer.
    """
    _check_at_rest(node)
    parameters = {address: data for address, data in sorted(file.values.items()) if is_parameter(node.entries[address])}
    written, refused = 0, list[str]()
    for address, data in parameters.items():
        try:
            written += _set(node, node.entries[address], data)
        except ObjectRefusedError as error:
            refused.append(str(error))
    same = len(parameters) - written - len(refused)
    return Restored(written, same, len(file.values) - len(parameters), tuple(refused))


def _check_at_rest(node: NodeWatch) -> None:
    word = node.number(STATUSWORD)
    state = None if word is None else power_state(int(word))
    if state is None or state in POWERED:
        told = "no known state" if state is None else str(state)
        raise UserError(f"{node.name} is in {told}; stop the motion and disable the drive, then write its parameters")


def _set(node: NodeWatch, entry: ObjectEntry, data: bytes) -> bool:
    """Whether the drive had to be told. Raises ObjectRefusedError where it does not take the value."""
    where = (entry.index, entry.subindex)
    if node.read(*where) == data:
        return False
    value = decode(entry.data_type, data)
    low, high = limits(entry) if entry.data_type in BITS else (0, 0)
    if isinstance(value, int | float) and not low <= value <= high:
        raise ObjectRefusedError(f"{_place(entry)}: {value:g} is outside {low:g} to {high:g}")
    node.write(*where, data)
    if (held := node.read(*where)) != data:
        raise ObjectRefusedError(f"{_place(entry)}: the drive took {value} as {decode(entry.data_type, held)}")
    return True


def _place(entry: ObjectEntry) -> str:
    return f"{entry.name} ({entry.index:04X}h:{entry.subindex:02X})"
