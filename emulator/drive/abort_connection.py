"""What the drive does when it loses its master (CiA 402-2, clause 'Abort connection option code', 6007h)."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

from drivetwin.emulator.canopen.device import Device
from drivetwin.emulator.canopen.emergency import COMMUNICATION
from drivetwin.emulator.canopen.nmt import NmtState
from drivetwin.emulator.canopen.object_dictionary import Variable
from drivetwin.emulator.drive.state_machine import Command, State, StateMachine


class Option(IntEnum):
    """Values of 6007h."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


ENABLED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
"""States in which a lost master matters: without power on the motor there is nothing to abort, and no fault to reset."""


class AbortConnection:
    """Acts on bus off, a heartbeat event, a life guarding event, NMT stopped and reset communication, as 6007h says."""

    def __init__(self, option: Variable, device: Device, machine: StateMachine, fault: Callable[[int], None]) -> None:
        self._option = option
        self._machine = machine
        self._fault = fault
        device.error_behaviour.on_error.append(self.lost)
        device.nmt.on_change.append(self._look_at)
        device.nmt.on_reset_communication.append(lambda: self.lost(COMMUNICATION))

    def lost(self, code: int) -> None:
        """The connection is lost, for the reason that an error code tells."""
        if self._machine.state not in ENABLED:
            return
        option = Option(self._option.number)
        if option is Option.FAULT:
            self._fault(code)
        elif option is Option.DISABLE_VOLTAGE:
            self._machine.obey(Command.DISABLE_VOLTAGE)
        elif option is Option.QUICK_STOP:
            self._machine.obey(Command.QUICK_STOP)

    def _look_at(self, state: NmtState) -> None:
        if state is NmtState.STOPPED:
            self.lost(COMMUNICATION)
