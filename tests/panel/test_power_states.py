"""The states and commands that the panel shows are those of the drive's own state machine, written from the same standard."""

from __future__ import annotations

import pytest

from drivetwin.emulator.drive.state_machine import State, StateMachine
from drivetwin.panel.power_states import COMMANDS, Command, PowerState, allowed, bit_names, power_state

STATES = list(State)


@pytest.mark.parametrize("state", STATES)
def test_each_state_is_read_from_its_statusword(state: State) -> None:
    machine = StateMachine()
    machine.state = state
    shown = power_state(machine.statusword() | 0x1480)
    assert shown is PowerState[state.name]


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_a_command_is_offered_where_it_does_something(state: State, command: Command) -> None:
    """Bit 7 is looked at in a fault alone: elsewhere the controlword of a reset disables the voltage, and is not offered."""
    machine = StateMachine()
    machine.state = state
    machine.write_controlword(command.controlword)
    acts = machine.state is not state or machine.stop is not None
    offered = command.name in allowed(PowerState[state.name])
    assert offered == (acts and (command.name != "Fault reset" or state is State.FAULT))


def test_bits_of_no_state_are_none() -> None:
    assert power_state(0x0001) is None


def test_bits_12_and_13_are_named_by_the_mode() -> None:
    assert bit_names(6)[12:14] == ["homing attained", "homing error"]
    assert bit_names(None)[12] == "mode bit 12"
