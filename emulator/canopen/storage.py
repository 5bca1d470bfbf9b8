"""Store and restore parameters on command: 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14).

What was stored is the power-on value from the next reset on; what is restored becomes valid with the next reset, too.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

from drivetwin.drive_profiles import Access
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value, decode, encode
from drivetwin.emulator.canopen.object_dictionary import COMMUNICATION_AREA, ObjectDictionary, Variable, check_length
from drivetwin.emulator.canopen.parameter_store import Address, Group, ParameterStore, Values

logger = logging.getLogger(__name__)

STORE, RESTORE = 0x1010, 0x1011

SAVE_SIGNATURE = int.from_bytes(b"save", "little")
LOAD_SIGNATURE = int.from_bytes(b"load", "little")

ON_COMMAND = 1
"""Bit 0 of 1010h and 1011h: the device stores, or restores, when it is told to."""

GROUPS = {
    1: (Group.COMMUNICATION, Group.APPLICATION),
    2: (Group.COMMUNICATION,),
    3: (Group.APPLICATION,),
}
"""What each sub-index of 1010h and 1011h means."""


class Storage:
    """1010h and 1011h of one node. Without a store, and where it cannot be written, they abort with 0606 0000h."""

    def __init__(self, od: ObjectDictionary, store: ParameterStore | None) -> None:
        self._od = od
        self._store = store
        self._factory: dict[Group, dict[Address, Value]] = {group: {} for group in Group}
        self._bind(STORE, SAVE_SIGNATURE, self._save)
        self._bind(RESTORE, LOAD_SIGNATURE, self._restore)

    def withdraw(self, group: Group) -> None:
        """Make the factory's values of a group its power-on values again."""
        for address, value in self._factory[group].items():
            self._od[address].default = value
        self._factory[group] = {}

    def apply(self, group: Group) -> None:
        """Make the stored values of a group its power-on values. One that does not fit its object is left out."""
        stored: Values = self._store.values(group) if self._store is not None else {}
        for address, data in stored.items():
            variable = self._od.get(address)
            value = None if variable is None else _decoded(variable, data)
            if variable is None or value is None:
                logger.warning("stored value of %04Xh:%02X does not fit this drive and is left out", *address)
                continue
            self._factory[group][address] = variable.default
            variable.default = value

    def _bind(self, index: int, signature: int, act: Callable[[tuple[Group, ...]], None]) -> None:
        for subindex, groups in GROUPS.items():
            variable = self._od.get((index, subindex))
            if variable is not None:
                variable.on_read = lambda: ON_COMMAND if self._store is not None else 0
                variable.on_write = lambda value, groups=groups: self._command(value, signature, lambda: act(groups))

    def _command(self, value: Value, signature: int, act: Callable[[], None]) -> None:
        if value != signature:
            raise SdoAbort(AbortCode.NOT_STORED)
        try:
            act()
        except OSError as error:
            logger.warning("parameters are not stored: %s", error)
            raise SdoAbort(AbortCode.HARDWARE) from None

    def _save(self, groups: tuple[Group, ...]) -> None:
        self._present_store().replace({group: self._changed(group) for group in groups})

    def _restore(self, groups: tuple[Group, ...]) -> None:
        self._present_store().replace({group: {} for group in groups})

    def _present_store(self) -> ParameterStore:
        if self._store is None:
            raise SdoAbort(AbortCode.HARDWARE)
        return self._store

    def _changed(self, group: Group) -> Values:
        """What differs from the factory's values, so that a CAN-ID that follows the node-ID goes on following it."""
        changed = {}
        for variable in self._od:
            if _group(variable) is group and _is_parameter(variable) and variable.value != self._factory_value(group, variable):
                changed[variable.index, variable.subindex] = encode(variable.data_type, variable.value)
        return changed

    def _factory_value(self, group: Group, variable: Variable) -> Value:
        """The value that a restored drive has; the default, where none of the store's has taken its place."""
        return self._factory[group].get((variable.index, variable.subindex), variable.default)


def _group(variable: Variable) -> Group:
    return Group.COMMUNICATION if variable.index in COMMUNICATION_AREA else Group.APPLICATION


def _is_parameter(variable: Variable) -> bool:
    return variable.access is Access.RW and variable.on_read is None and variable.is_parameter


def _decoded(variable: Variable, data: bytes) -> Value | None:
    """The value that was stored; None where it is not one of this object."""
    try:
        if variable.size is not None:
            check_length(len(data), variable.size)
        value = decode(variable.data_type, data)
        variable.check(value)
    except SdoAbort:
        return None
    return value
