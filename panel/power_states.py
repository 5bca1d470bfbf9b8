"""The state machine of a drive as a master sees it: states, statusword bits and commands (CiA 402-2, clause 'FSA')."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

FREE_MASK, STATE_MASK = 0x4F, 0x6F


class PowerState(StrEnum):
    """States of the FSA, named as the standard does."""

    NOT_READY_TO_SWITCH_ON = "Not ready to switch on"
    SWITCH_ON_DISABLED = "Switch on disabled"
    READY_TO_SWITCH_ON = "Ready to switch on"
    SWITCHED_ON = "Switched on"
    OPERATION_ENABLED = "Operation enabled"
    QUICK_STOP_ACTIVE = "Quick stop active"
    FAULT_REACTION_ACTIVE = "Fault reaction active"
    FAULT = "Fault"


_FREE = {
    0x00: PowerState.NOT_READY_TO_SWITCH_ON,
    0x40: PowerState.SWITCH_ON_DISABLED,
    0x0F: PowerState.FAULT_REACTION_ACTIVE,
    0x08: PowerState.FAULT,
}
"""States in which bit 5 does not count."""

_STATES = {
    0x21: PowerState.READY_TO_SWITCH_ON,
    0x23: PowerState.SWITCHED_ON,
    0x27: PowerState.OPERATION_ENABLED,
    0x07: PowerState.QUICK_STOP_ACTIVE,
}


def power_state(statusword: int) -> PowerState | None:
    """The state that 6041h tells (table 'State coding'); None for bits of no state."""
    return _FREE.get(statusword & FREE_MASK) or _STATES.get(statusword & STATE_MASK)


@dataclass(frozen=True)
class Command:
    """A command of the controlword (table 'Command coding'), and the states in which it does something."""

    name: str
    controlword: int
    states: frozenset[PowerState]


COMMANDS = (
    Command("Shutdown", 0x06, frozenset(
        {PowerState.SWITCH_ON_DISABLED, PowerState.SWITCHED_ON, PowerState.OPERATION_ENABLED}
    )),
    Command("Switch on", 0x07, frozenset({PowerState.READY_TO_SWITCH_ON, PowerState.OPERATION_ENABLED})),
    Command("Enable operation", 0x0F, frozenset(
        {PowerState.READY_TO_SWITCH_ON, PowerState.SWITCHED_ON, PowerState.QUICK_STOP_ACTIVE}
    )),
    Command("Quick stop", 0x02, frozenset(
        {PowerState.READY_TO_SWITCH_ON, PowerState.SWITCHED_ON, PowerState.OPERATION_ENABLED}
    )),
    Command("Disable voltage", 0x00, frozenset(
        {PowerState.READY_TO_SWITCH_ON, PowerState.SWITCHED_ON, PowerState.OPERATION_ENABLED, PowerState.QUICK_STOP_ACTIVE}
    )),
    Command("Fault reset", 0x80, frozenset({PowerState.FAULT})),
)  # fmt: skip


def allowed(state: PowerState | None) -> tuple[str, ...]:
    """Names of the commands that do something in a state."""
    return tuple(command.name for command in COMMANDS if state in command.states)


_BITS = {
    0: "ready to switch on",
    1: "switched on",
    2: "operation enabled",
    3: "fault",
    4: "voltage enabled",
    5: "quick stop (low: active)",
    6: "switch on disabled",
    7: "warning",
    8: "manufacturer 8",
    9: "remote",
    10: "target reached",
    11: "internal limit active",
    12: "mode bit 12",
    13: "mode bit 13",
    14: "manufacturer 14",
    15: "manufacturer 15",
}

_OF_MODE = {
    (1, 12): "set-point acknowledge",
    (1, 13): "following error",
    (3, 12): "speed is 0",
    (3, 13): "slippage error",
    (6, 12): "homing attained",
    (6, 13): "homing error",
    (7, 12): "interpolation active",
    (8, 12): "follows the command value",
    (8, 13): "following error",
    (9, 12): "follows the command value",
    (10, 12): "follows the command value",
}
"""Bits 12 and 13 by the mode of operation (CiA 402-2, the modes' own clauses)."""


def bit_names(mode: int | None) -> list[str]:
    """Names of bits 0 to 15 of 6041h in a mode of operation (6061h)."""
    return [_OF_MODE.get((mode or 0, bit), name) for bit, name in _BITS.items()]


_MODES = {
    0: "no mode",
    1: "profile position",
    2: "velocity",
    3: "profile velocity",
    4: "profile torque",
    6: "homing",
    7: "interpolated position",
    8: "cyclic synchronous position",
    9: "cyclic synchronous velocity",
    10: "cyclic synchronous torque",
}


def mode_name(mode: int | None) -> str:
    """A value of 6060h or 6061h in words."""
    if mode is None:
        return "unknown"
    return _MODES.get(mode, "manufacturer-specific" if mode < 0 else "reserved")
