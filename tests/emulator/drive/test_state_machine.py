"""CiA 402-2 (IEC 61800-7-201), clause 'FSA': every state by every command, the statusword, and the stops on a moving axis."""

from __future__ import annotations

from math import inf, log

import pytest
from drive_bench import (
    CYCLE,
    DISABLE_VOLTAGE,
    ENABLE,
    FAULT_RESET,
    HALT,
    PROFILE_VELOCITY,
    QUICK_STOP,
    SHUTDOWN,
    SWITCH_ON,
    DriveBench,
)

from drivetwin.emulator.drive.servo import VELOCITY, Loop
from drivetwin.emulator.drive.state_machine import Command, State, StateMachine, Stop, command_of
from drivetwin.emulator.drive.stops import STANDSTILL, STANDSTILL_TIME

OFF, READY, ON, RUN = State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.SWITCHED_ON, State.OPERATION_ENABLED
QUICK, REACTION, FAULT, BOOT = (
    State.QUICK_STOP_ACTIVE,
    State.FAULT_REACTION_ACTIVE,
    State.FAULT,
    State.NOT_READY_TO_SWITCH_ON,
)


@pytest.mark.parametrize(
    ("pattern", "command"),
    [  # table 'Command coding': bits 7, 3, 2, 1, 0
        ("0x110", Command.SHUTDOWN),
        ("00111", Command.SWITCH_ON),
        ("01111", Command.ENABLE_OPERATION),
        ("0xx0x", Command.DISABLE_VOLTAGE),
        ("0x01x", Command.QUICK_STOP),
    ],
)
def test_command_coding(pattern: str, command: Command) -> None:
    patterns = [pattern]
    for _ in range(pattern.count("x")):
        patterns = [one.replace("x", bit, 1) for one in patterns for bit in "01"]
    for bits in patterns:
        controlword = int(bits[0]) << 7 | int(bits[1:], 2)
        for others in (0x000, 0x170, 0xFE70):
            assert command_of(controlword | others) is command


def machine_in(state: State) -> StateMachine:
    """Brought there by commands alone."""
    machine = StateMachine()
    if state is BOOT:
        return machine
    machine.power_on()
    path = {OFF: [], READY: [0x06], ON: [0x06, 0x07], FAULT: [], REACTION: [0x06, 0x07, 0x0F]}
    for controlword in path.get(state, [0x06, 0x07, 0x0F]):
        machine.write_controlword(controlword)
    if state is QUICK:
        machine.write_controlword(0x02)
        machine.stopped()
    if state in (FAULT, REACTION):
        machine.fault()
    assert machine.state is state
    return machine


COMMANDS = {
    "disable voltage": 0x00,
    "quick stop": 0x02,
    "shutdown": 0x06,
    "switch on": 0x07,
    "enable operation": 0x0F,
    "fault reset": 0x80,
}

TRANSITIONS = [
    # state, disable voltage, quick stop, shutdown, switch on, enable operation, fault reset
    (BOOT, BOOT, BOOT, BOOT, BOOT, BOOT, BOOT),
    (OFF, OFF, OFF, READY, OFF, OFF, OFF),  # 2
    (READY, OFF, OFF, READY, ON, RUN, OFF),  # 7, 7, -, 3, 3+4
    (ON, OFF, OFF, READY, ON, RUN, OFF),  # 10, 10, 6, -, 4
    (RUN, OFF, QUICK, READY, ON, RUN, OFF),  # 9, 11, 8, 5, -
    (QUICK, OFF, QUICK, QUICK, QUICK, RUN, OFF),  # 12, -, -, -, 16
    (REACTION, REACTION, REACTION, REACTION, REACTION, REACTION, REACTION),
    (FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, OFF),  # 15
]
"""A controlword of 80h has bit 1 clear: in a state without fault it is 'disable voltage' as well."""


@pytest.mark.parametrize(
    ("state", "command", "following"),
    [(row[0], name, row[1 + number]) for row in TRANSITIONS for number, name in enumerate(COMMANDS)],
)
def test_transitions(state: State, command: str, following: State) -> None:
    machine = machine_in(state)
    machine.write_controlword(COMMANDS[command])
    if machine.stop in (Stop.SHUTDOWN, Stop.DISABLE_OPERATION):
        assert machine.state is RUN  # 5 and 8 are done when the axis stands
        machine.stopped()
    assert machine.state is following


@pytest.mark.parametrize("state", [OFF, READY, ON, RUN, QUICK])
def test_a_fault_comes_from_any_state(state: State) -> None:
    machine = machine_in(state)
    machine.fault()
    if state in (RUN, QUICK):
        assert machine.state is REACTION  # 13
        assert machine.stop is Stop.FAULT_REACTION
        machine.stopped()
    assert machine.state is FAULT  # 14
    machine.fault()
    assert machine.state is FAULT


def test_fault_reset_needs_a_rising_edge() -> None:
    machine = machine_in(RUN)
    machine.write_controlword(0x8F)
    machine.fault()
    machine.stopped()
    machine.write_controlword(0x8F)
    assert machine.state is FAULT
    machine.write_controlword(0x0F)
    assert machine.state is FAULT
    machine.write_controlword(0x8F)
    assert machine.state is OFF
    machine.write_controlword(0x8F)
    assert machine.state is OFF


def test_enabling_again_while_it_stops_goes_on() -> None:
    machine = machine_in(RUN)
    machine.write_controlword(0x07)
    assert machine.stop is Stop.DISABLE_OPERATION
    machine.write_controlword(0x0F)
    assert machine.state is RUN
    assert machine.stop is None


def test_no_way_back_while_the_quick_stop_ramps() -> None:
    machine = machine_in(RUN)
    machine.write_controlword(0x02)
    machine.write_controlword(0x0F)
    assert machine.state is QUICK
    machine.stopped()
    machine.write_controlword(0x0F)
    assert machine.state is RUN


@pytest.mark.parametrize(
    ("state", "pattern"),
    [  # table 'State coding': bits 6, 5, 3, 2, 1, 0
        (BOOT, "0x0000"),
        (OFF, "1x0000"),
        (READY, "010001"),
        (ON, "010011"),
        (RUN, "010111"),
        (QUICK, "000111"),
        (REACTION, "0x1111"),
        (FAULT, "0x1000"),
    ],
)
def test_statusword(state: State, pattern: str) -> None:
    word = machine_in(state).statusword()
    for bit, expected in zip((6, 5, 3, 2, 1, 0), pattern, strict=True):
        assert expected in ("x", str(word >> bit & 1))
    assert word & 1 << 9  # remote
    assert word & 1 << 4  # voltage enabled
    assert not word & (1 << 7 | 1 << 8 | 1 << 10 | 1 << 11 | 1 << 12 | 1 << 13 | 1 << 14 | 1 << 15)


# -- on a moving axis, on the simulated clock -------------------------------------------------------------------------

SPEED, PROFILE, QUICK_RAMP = 40.0, 200.0, 800.0
"""Motor speed [rad/s], 6084h and 6085h [rad/s²]."""


def moving(machine: str = "stage", axis: str = "slide") -> DriveBench:
    bench = DriveBench(machine, axis)
    for index, value in ((0x6083, PROFILE), (0x6084, PROFILE), (0x6085, QUICK_RAMP), (0x60FF, SPEED)):
        bench.write(index, bench.units(value))
    bench.enable(PROFILE_VELOCITY)
    bench.sync(300)
    assert bench.joint_velocity * bench.configuration.gear_ratio == pytest.approx(SPEED, rel=0.2)
    return bench


def cycles_until(bench: DriveBench, *states: State, limit: int = 400) -> int:
    for cycle in range(1, limit):
        bench.sync()
        if bench.state in states:
            return cycle
    raise AssertionError(f"still {bench.state}")


def ramp(bench: DriveBench, deceleration: float) -> float:
    """Cycles that the ramp from the present speed takes."""
    return bench.joint_velocity * bench.configuration.gear_ratio / deceleration / CYCLE


def settling(deceleration: float) -> float:
    """Cycles in which the lag behind a ramp dies down to standstill, at most: tau ln(a tau / v), and the time to see it.

    The stage's P loops make it a system of second order; its envelope decays with tau = 2 m / Kv, quicker with friction.
    """
    tau = 2.0 * 95.0 / 8500.0
    return (tau * log(deceleration * tau / STANDSTILL) + STANDSTILL_TIME) / CYCLE


def motor_speed(bench: DriveBench) -> float:
    return abs(bench.joint_velocity) * bench.configuration.gear_ratio


@pytest.mark.parametrize(
    ("option", "deceleration", "final"),
    [(0, inf, OFF), (1, PROFILE, OFF), (2, QUICK_RAMP, OFF), (5, PROFILE, QUICK), (6, QUICK_RAMP, QUICK)],
)
def test_quick_stop_option_code(option: int, deceleration: float, final: State) -> None:
    """605Ah: 0 drive off, 1 and 5 slow-down ramp, 2 and 6 quick-stop ramp; 5 and 6 stay in quick stop active."""
    bench = moving()
    cycles = ramp(bench, deceleration)
    bench.write(0x605A, option)
    bench.write(0x6040, QUICK_STOP)
    bench.sync()
    elapsed = 1
    while bench.drive.axis.servo.loop is not Loop.OFF and bench.drive.axis.servo.demand[-1, VELOCITY] > 0.0:
        assert bench.state is QUICK
        bench.sync()
        elapsed += 1
    assert elapsed == pytest.approx(cycles, abs=2)
    bench.sync(400)
    assert bench.state is final
    assert abs(bench.joint_velocity) < 1e-6
    if final is QUICK:
        bench.write(0x6040, ENABLE)
        bench.sync(300)
        assert bench.state is RUN
        assert bench.joint_velocity > 0.0


@pytest.mark.parametrize(
    ("controlword", "option_code", "option", "final"),
    [(SWITCH_ON, 0x605C, 1, ON), (SHUTDOWN, 0x605B, 1, READY)],
)
def test_disabling_ramps_as_its_option_says(controlword: int, option_code: int, option: int, final: State) -> None:
    """By 6084h, and not before the axis itself stands."""
    bench = moving()
    cycles = ramp(bench, PROFILE)
    bench.write(option_code, option)
    bench.write(0x6040, controlword)
    assert cycles <= cycles_until(bench, final) <= cycles + settling(PROFILE)
    assert motor_speed(bench) < STANDSTILL
    bench.sync()
    assert bench.read(0x6074) == 0


@pytest.mark.parametrize(
    ("controlword", "option_code", "option", "final"),
    [(SWITCH_ON, 0x605C, 0, ON), (SHUTDOWN, 0x605B, 0, READY), (DISABLE_VOLTAGE, 0x605C, 1, OFF)],
)
def test_disabling_switches_off_as_its_option_says(controlword: int, option_code: int, option: int, final: State) -> None:
    bench = moving()
    bench.write(option_code, option)
    bench.write(0x6040, controlword)
    assert cycles_until(bench, final) <= 2
    bench.sync()
    assert bench.read(0x6074) == 0


@pytest.mark.parametrize(("option", "deceleration"), [(1, PROFILE), (2, QUICK_RAMP)])
def test_fault_reaction_option_code(option: int, deceleration: float) -> None:
    """605Eh: 1 slow-down ramp, 2 quick-stop ramp, from the speed that the axis has; fault when it stands."""
    bench = moving()
    bench.write(0x605E, option)
    cycles = ramp(bench, deceleration)
    bench.drive.fault(0x8611)
    assert bench.state is REACTION
    assert cycles <= cycles_until(bench, FAULT) <= cycles + settling(deceleration)
    assert motor_speed(bench) < STANDSTILL


def test_fault_reaction_by_switching_off() -> None:
    """605Eh = 0: at once; and what a fault leaves in 603Fh and 1001h until it is reset."""
    bench = moving()
    bench.write(0x605E, 0)
    bench.drive.fault(0x8611)
    assert cycles_until(bench, FAULT) <= 2
    assert bench.emergencies() == [0x8611]
    assert (bench.read(0x603F), bench.read(0x1001)) == (0x8611, 0x21)
    bench.command(ENABLE)
    assert bench.state is FAULT
    bench.command(FAULT_RESET)
    assert bench.state is OFF
    assert bench.emergencies() == [0x8611, 0]
    assert (bench.read(0x603F), bench.read(0x1001)) == (0, 0)


@pytest.mark.parametrize(("option", "deceleration"), [(1, PROFILE), (2, QUICK_RAMP)])
def test_halt(option: int, deceleration: float) -> None:
    """Bit 8 with 605Dh: slow down and stay enabled; statusword bit 10 says when the axis stands; go on when it is cleared."""
    bench = moving()
    bench.write(0x605D, option)
    cycles = ramp(bench, deceleration)
    bench.write(0x6040, HALT)
    elapsed = 0
    while not int(bench.read(0x6041)) & 1 << 10:
        bench.sync()
        elapsed += 1
    assert cycles <= elapsed <= cycles + settling(deceleration)
    assert motor_speed(bench) < STANDSTILL
    bench.sync(300)
    assert bench.state is RUN
    assert abs(bench.joint_velocity) < 1e-6
    bench.command(ENABLE)
    assert not int(bench.read(0x6041)) & 1 << 10
    bench.sync(300)
    assert bench.joint_velocity * bench.configuration.gear_ratio == pytest.approx(SPEED, rel=0.2)


def test_enabling_with_halt_after_a_disable_in_motion_stands_still() -> None:
    """What the axis did before it was switched off is no speed to ramp down from."""
    bench = moving()
    bench.command(DISABLE_VOLTAGE)
    bench.sync(500)
    start = bench.joint
    bench.command(SHUTDOWN, SWITCH_ON, HALT)
    bench.sync(300)
    assert bench.state is RUN
    assert abs(bench.joint - start) < 1e-6


def test_no_mode_ramps_down_and_holds() -> None:
    bench = moving()
    speed = motor_speed(bench)
    bench.write(0x6060, 0)
    rows = bench.record(500, 0x6062)
    assert abs(bench.joint_velocity) < 1e-6
    way = (rows[-1, 0] - rows[0, 0]) / bench.units(1.0)
    assert way == pytest.approx(speed**2 / (2.0 * PROFILE), rel=0.03)


def test_time_is_the_simulated_clock_alone() -> None:
    bench = moving()
    cycles = ramp(bench, PROFILE)
    bench.write(0x6040, SWITCH_ON)
    for _ in range(1000):
        bench.virtual.poll()
    assert bench.state is RUN
    assert cycles_until(bench, ON) >= cycles


def test_reset_node_switches_off() -> None:
    bench = moving()
    bench.drive.device.receive(0, bytes((0x81, bench.configuration.node_id)))
    assert bench.state is OFF
    bench.sync(400)
    assert abs(bench.joint_velocity) < 1e-6
    assert bench.read(0x6040) == 0
