"""Which statuswords may follow which: the state machine of CiA 402-2 (IEC 61800-7-201), as the standard's tables print it.

Written from the tables and not from the emulator's own, so that one may judge the other.
"""

from __future__ import annotations

NOT_READY, OFF, READY, ON, RUN, QUICK, REACTION, FAULT = 0x00, 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08
"""Statusword under mask 6Fh (table 'State coding')."""

NAMES = {
    NOT_READY: "not ready to switch on",
    OFF: "switch on disabled",
    READY: "ready to switch on",
    ON: "switched on",
    RUN: "operation enabled",
    QUICK: "quick stop active",
    REACTION: "fault reaction active",
    FAULT: "fault",
}

SHUTDOWN, SWITCH_ON, ENABLE = "shutdown", "switch on", "enable operation"
DISABLE_VOLTAGE, QUICK_STOP = "disable voltage", "quick stop"

_CODING = (
    (0x02, 0x00, DISABLE_VOLTAGE),
    (0x06, 0x02, QUICK_STOP),
    (0x07, 0x06, SHUTDOWN),
    (0x0F, 0x07, SWITCH_ON),
    (0x0F, 0x0F, ENABLE),
)
"""Mask, bits and command of a controlword (table 'Command coding')."""

FAULT_RESET = 0x80

_BY_COMMAND: dict[tuple[int, str], frozenset[int]] = {
    (OFF, SHUTDOWN): frozenset({READY}),  # transition 2
    (READY, SWITCH_ON): frozenset({ON}),  # 3
    (READY, ENABLE): frozenset({RUN}),  # 3, and 4 at once
    (READY, DISABLE_VOLTAGE): frozenset({OFF}),  # 7
    (READY, QUICK_STOP): frozenset({OFF}),  # 7
    (ON, ENABLE): frozenset({RUN}),  # 4
    (ON, SHUTDOWN): frozenset({READY}),  # 6
    (ON, DISABLE_VOLTAGE): frozenset({OFF}),  # 10
    (ON, QUICK_STOP): frozenset({OFF}),  # 10
    (RUN, SWITCH_ON): frozenset({RUN, ON}),  # 5, once the axis stands
    (RUN, SHUTDOWN): frozenset({RUN, READY}),  # 8, once the axis stands
    (RUN, DISABLE_VOLTAGE): frozenset({OFF}),  # 9
    (RUN, QUICK_STOP): frozenset({QUICK}),  # 11
    (QUICK, DISABLE_VOLTAGE): frozenset({OFF}),  # 12
    (QUICK, ENABLE): frozenset({QUICK, RUN}),  # 16, where the option code stays and the axis stands
}

_LOST = {1: frozenset({REACTION, FAULT}), 2: frozenset({OFF}), 3: frozenset({QUICK})}
"""What 6007h makes of a drive with power on its motor that has lost its master (table 'Abort connection option code')."""

_ONCE_IT_STANDS = {SWITCH_ON: ON, SHUTDOWN: READY}


def command_of(controlword: int) -> str:
    """The command of a controlword."""
    return next(name for mask, bits, name in _CODING if controlword & mask == bits)


def after_controlword(state: int, controlword: int, former: int) -> frozenset[int]:
    """States that may follow a controlword, the one before it being `former`."""
    reset = bool(controlword & FAULT_RESET)
    if state == FAULT:
        return frozenset({FAULT, OFF}) if reset and not former & FAULT_RESET else frozenset({FAULT})  # 15
    here = frozenset({state})
    following = _BY_COMMAND.get((state, command_of(controlword)), here)
    return following | here if reset else following  # bit 7 is 0 in every command; what it does beside one is open


def after_lost_connection(state: int, option: int) -> frozenset[int]:
    """States that may follow where the master is lost, `option` being 6007h."""
    here = frozenset({state})
    return _LOST.get(option, here) if state in (RUN, QUICK) else here


def after_time(state: int, controlword: int) -> frozenset[int]:
    """States that may follow by themselves, the controlword being what came last."""
    following = {state, REACTION, FAULT}  # 13 from every state, 14
    if state == RUN:
        stop = _ONCE_IT_STANDS.get(command_of(controlword))
        following |= {stop} if stop is not None else set()
    if state == QUICK:
        following.add(OFF)  # 12
    return frozenset({FAULT}) if state == FAULT else frozenset(following)
