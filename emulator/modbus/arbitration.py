"""One drive, two masters: decides which one may command it.

Whoever brings a drive to 'operation enabled' has control of it until its power stage is off again. Meanwhile the other
master reads everything, may write quick stop and disable voltage, and is refused the rest of 6040h, the mode and the
set-points with abort 0800 0021h (local control). While the power stage is off both may write.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum, auto

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.drive.state_machine import Command, command_of

CONTROLWORD = (0x6040, 0)

ARBITRATED = frozenset({0x6040, 0x6042, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FF})
"""Controlword, mode, and every set-point of CiA 402-2; a drive type adds its own."""

ALWAYS_ALLOWED = (Command.DISABLE_VOLTAGE, Command.QUICK_STOP)

OPERATION_ENABLED, QUICK_STOP_ACTIVE = 0x27, 0x07
FAULT_REACTION_ACTIVE = 0x0F


class Master(Enum):
    """The two sides from which a drive can be commanded; all Modbus clients together are one."""

    CANOPEN = auto()
    MODBUS = auto()


class Arbitration:
    """Stands before the writes of one drive's controlword, mode and set-points.

    `more` are the drive type's own set-points. What writes is CANopen, except within `modbus()`.
    """

    def __init__(self, dictionary: ObjectDictionary, more: tuple[tuple[int, int], ...] = ()) -> None:
        self._statusword = dictionary[0x6041]
        self._acting = Master.CANOPEN
        self._enabler: Master | None = None
        self._controlword = dictionary[CONTROLWORD]
        self._guarded = {
            variable
            for variable in dictionary
            if variable.access.writable and (variable.index in ARBITRATED or (variable.index, variable.subindex) in more)
        }
        for variable in self._guarded:
            variable.on_write = self._guard(variable, variable.on_write)

    @property
    def in_control(self) -> Master | None:
        """The master that has control now; None while the power stage is off."""
        return self._enabler if _powered(int(self._statusword.read())) else None

    @contextmanager
    def modbus(self) -> Iterator[None]:
        """What is written within is written by Modbus."""
        self._acting = Master.MODBUS
        try:
            yield
        finally:
            self._acting = Master.CANOPEN

    def permit(self, variable: Variable, value: Value) -> None:
        """Raise SdoAbort where the acting master may not write `value` now."""
        if variable not in self._guarded or self.in_control in (None, self._acting):
            return
        if variable is self._controlword and command_of(int(value)) in ALWAYS_ALLOWED:
            return
        raise SdoAbort(AbortCode.LOCAL_CONTROL)

    def _guard(self, variable: Variable, earlier: Callable[[Value], None] | None) -> Callable[[Value], None]:
        def write(value: Value) -> None:
            self.permit(variable, value)
            if variable is self._controlword and command_of(int(value)) is Command.ENABLE_OPERATION:
                self._enabler = self._acting
            if earlier is not None:
                earlier(value)

        return write


def _powered(statusword: int) -> bool:
    """Whether the power stage is on: operation enabled, quick stop active or fault reaction active."""
    return statusword & 0x6F in (OPERATION_ENABLED, QUICK_STOP_ACTIVE) or statusword & 0x4F == FAULT_REACTION_ACTIVE
