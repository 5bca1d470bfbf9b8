"""The state machine of a power drive system: states, commands, statusword (CiA 402-2 / IEC 61800-7-201, clause 'FSA')."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, IntEnum, auto

from drivetwin.foundation.enums import quick


@quick
class State(Enum):
    """States of the FSA with their statusword bits under mask 006Fh."""

    NOT_READY_TO_SWITCH_ON = 0x0000
    SWITCH_ON_DISABLED = 0x0040
    READY_TO_SWITCH_ON = 0x0021
    SWITCHED_ON = 0x0023
    OPERATION_ENABLED = 0x0027
    QUICK_STOP_ACTIVE = 0x0007
    FAULT_REACTION_ACTIVE = 0x000F
    FAULT = 0x0008

    def __init__(self, bits: int) -> None:
        self.bits = bits


@quick
class Command(Enum):
    """Commands of the controlword; bits 0..3 and 7 decide."""

    SHUTDOWN = auto()
    SWITCH_ON = auto()
    ENABLE_OPERATION = auto()
    DISABLE_VOLTAGE = auto()
    QUICK_STOP = auto()


@quick
class Statusword(IntEnum):
    """Bits of 6041h beside those of the state."""

    VOLTAGE_ENABLED = 1 << 4
    QUICK_STOP = 1 << 5
    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    INTERNAL_LIMIT_ACTIVE = 1 << 11
    MODE_BIT_12 = 1 << 12
    MODE_BIT_13 = 1 << 13


ALWAYS = int(Statusword.VOLTAGE_ENABLED | Statusword.REMOTE)
"""Bits of 6041h in every state."""


@quick
class Controlword(IntEnum):
    """Bits of 6040h beside those of the command."""

    MODE_BIT_4 = 1 << 4
    MODE_BIT_5 = 1 << 5
    MODE_BIT_6 = 1 << 6
    FAULT_RESET = 1 << 7
    HALT = 1 << 8


@quick
class Stop(Enum):
    """A ramp to standstill that a transition asks for, named by the option code that says how."""

    QUICK_STOP = 0x605A
    SHUTDOWN = 0x605B
    DISABLE_OPERATION = 0x605C
    FAULT_REACTION = 0x605E


STAY_ENABLED = 0x0F
"""Bits of the commonest command, 'enable operation', which an enabled drive gets with every set-point."""


def command_of(controlword: int) -> Command:
    """Command in a controlword (CiA 402-2, table 'Command coding')."""
    if not controlword & 0x02:
        return Command.DISABLE_VOLTAGE
    if not controlword & 0x04:
        return Command.QUICK_STOP
    if not controlword & 0x01:
        return Command.SHUTDOWN
    return Command.ENABLE_OPERATION if controlword & 0x08 else Command.SWITCH_ON


_AT_ONCE = {
    (State.SWITCH_ON_DISABLED, Command.SHUTDOWN): State.READY_TO_SWITCH_ON,  # transition 2
    (State.READY_TO_SWITCH_ON, Command.SWITCH_ON): State.SWITCHED_ON,  # 3
    (State.READY_TO_SWITCH_ON, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 7
    (State.READY_TO_SWITCH_ON, Command.QUICK_STOP): State.SWITCH_ON_DISABLED,  # 7
    (State.SWITCHED_ON, Command.ENABLE_OPERATION): State.OPERATION_ENABLED,  # 4
    (State.SWITCHED_ON, Command.SHUTDOWN): State.READY_TO_SWITCH_ON,  # 6
    (State.SWITCHED_ON, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 10
    (State.SWITCHED_ON, Command.QUICK_STOP): State.SWITCH_ON_DISABLED,  # 10
    (State.READY_TO_SWITCH_ON, Command.ENABLE_OPERATION): State.OPERATION_ENABLED,  # 3 and 4 in one
    (State.OPERATION_ENABLED, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 9
    (State.QUICK_STOP_ACTIVE, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 12
    (State.QUICK_STOP_ACTIVE, Command.ENABLE_OPERATION): State.OPERATION_ENABLED,  # 16
}

_STOPPING = {
    Command.SHUTDOWN: (Stop.SHUTDOWN, State.READY_TO_SWITCH_ON),  # transition 8
    Command.SWITCH_ON: (Stop.DISABLE_OPERATION, State.SWITCHED_ON),  # 5
}


class StateMachine:
    """The FSA of one drive. It decides; the drive acts on `state` and on `stop`, and reports standstill."""

    def __init__(self) -> None:
        self.state = State.NOT_READY_TO_SWITCH_ON
        self.stop: Stop | None = None
        self._after_stop: State | None = None
        self._last_controlword = 0
        self.may_reset: Callable[[], bool] = lambda: True
        """Whether the cause of a fault is gone; without that transition 15 is refused."""

    def power_on(self) -> None:
        """Transitions 0 and 1: self-test done."""
        self.state = State.SWITCH_ON_DISABLED
        self._clear_stop()
        self._last_controlword = 0

    def write_controlword(self, controlword: int) -> None:
        """Apply a controlword; bit 7 acts on its rising edge (transition 15)."""
        rising = controlword & ~self._last_controlword
        self._last_controlword = controlword
        if self.state is State.OPERATION_ENABLED and controlword & STAY_ENABLED == STAY_ENABLED:
            self.stop = self._after_stop = None
            return
        if self.state is State.FAULT:
            if rising & Controlword.FAULT_RESET and self.may_reset():
                self.state = State.SWITCH_ON_DISABLED
            return
        if self.state not in (State.FAULT_REACTION_ACTIVE, State.NOT_READY_TO_SWITCH_ON):
            self.obey(command_of(controlword))

    def obey(self, command: Command) -> None:
        """Apply a command, of the master or of the drive itself; not in a fault."""
        if self.state is State.OPERATION_ENABLED:
            if command is Command.ENABLE_OPERATION:
                self._clear_stop()
                return
            if command is Command.QUICK_STOP:  # transition 11
                self.state = State.QUICK_STOP_ACTIVE
                self._begin_stop(Stop.QUICK_STOP, None)
                return
            if command in _STOPPING:
                self._begin_stop(*_STOPPING[command])
                return
        if self.state is State.QUICK_STOP_ACTIVE and command is Command.ENABLE_OPERATION and self.stop is not None:
            return  # transition 16 only once the ramp has ended
        following = _AT_ONCE.get((self.state, command))
        if following is not None:
            self.state = following
            self._clear_stop()

    def fault(self) -> None:
        """Transition 13: any fault, from any state."""
        if self.state not in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            was_moving = self.state in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
            self.state = State.FAULT_REACTION_ACTIVE
            self._begin_stop(Stop.FAULT_REACTION, State.FAULT)
            if not was_moving:
                self.stopped()

    def stopped(self) -> None:
        """The ramp that `stop` asked for has ended: transitions 5, 8, 14. A quick stop stays active until `release`."""
        if self._after_stop is not None:
            self.state = self._after_stop
        self._clear_stop()

    def release_quick_stop(self) -> None:
        """Transition 12, after a quick stop with option code 1..4."""
        if self.state is State.QUICK_STOP_ACTIVE:
            self.state = State.SWITCH_ON_DISABLED
            self._clear_stop()

    def statusword(self) -> int:
        """State bits of 6041h with `voltage enabled` and `remote`."""
        return self.state.bits | ALWAYS

    def _begin_stop(self, stop: Stop, following: State | None) -> None:
        self.stop = stop
        self._after_stop = following

    def _clear_stop(self) -> None:
        self.stop = None
        self._after_stop = None
