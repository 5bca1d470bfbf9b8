"""When a stop has ended: the axis stands, by its own speed and not by its demand; and no stop waits for ever."""

from __future__ import annotations

import numpy as np
import pytest
from drive_bench import (
    CYCLE,
    CYCLIC,
    DISABLE_VOLTAGE,
    ENABLE,
    HALT,
    PROFILE_VELOCITY,
    QUICK_STOP,
    SHUTDOWN,
    SWITCH_ON,
    DriveBench,
)
from scipy.signal import lsim

from drivetwin.emulator.drive.servo import VELOCITY
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.drive.stops import PATIENCE, STANDSTILL, STANDSTILL_TIME

RAMP, SPEED = 400.0, 20.0
"""6084h and 6085h [rad/s²], speed [rad/s]."""


def moving() -> DriveBench:
    """A stage without friction, so that its loops alone stop it."""
    bench = DriveBench(effects=())
    for index, value in ((0x6083, RAMP), (0x6084, RAMP), (0x6085, RAMP), (0x60FF, SPEED)):
        bench.write(index, bench.units(value))
    bench.enable(PROFILE_VELOCITY)
    bench.sync(400)
    assert motor_speed(bench) == pytest.approx(SPEED, rel=1e-3)
    return bench


def motor_speed(bench: DriveBench) -> float:
    return bench.joint_velocity * bench.configuration.gear_ratio


def cycles_to(bench: DriveBench, state: State, limit: int = 4000) -> int:
    for cycle in range(1, limit):
        bench.sync()
        if bench.state is state:
            return cycle
    raise AssertionError(f"still {bench.state}")


STOPS = [
    (SWITCH_ON, State.SWITCHED_ON),
    (QUICK_STOP, State.SWITCH_ON_DISABLED),
    (None, State.FAULT),
]


def settled(gain: float) -> float:
    """Time [s] at which the speed of the linear loops falls below STANDSTILL for good, from the begin of the ramp.

    Following error e' = w - v, speed v' = Kv (Kp e - v) / J, for a ramp w: the stage without friction and current loop,
    which begins with the following error v / Kp of a steady motion.
    """
    rate = 8500.0 / 95.0014
    time = np.arange(0.0, 3.0, 1e-4)
    ramp = np.maximum(SPEED - RAMP * time, 0.0)
    system = ([[0.0, -1.0], [rate * gain, -rate]], [[1.0], [0.0]], [[0.0, 1.0]], [[0.0]])
    _, speed, _ = lsim(system, ramp, time, X0=[SPEED / gain, SPEED])
    return float(time[np.flatnonzero(np.abs(speed) >= STANDSTILL)[-1]])


@pytest.mark.parametrize("gain", [10.0, 20.0])
@pytest.mark.parametrize(("controlword", "final"), STOPS)
def test_a_creeping_axis_keeps_its_voltage(gain: float, controlword: int | None, final: State) -> None:
    """As long as the linear loops say that it creeps behind its ramp."""
    bench = moving()
    bench.write(0x60FB, gain, 1)
    if controlword is None:
        bench.drive.fault(0x8611)
    else:
        bench.write(0x6040, controlword)
    assert cycles_to(bench, final) * CYCLE == pytest.approx(settled(gain) + STANDSTILL_TIME, abs=0.01)
    assert abs(motor_speed(bench)) < STANDSTILL


def test_halt_is_told_when_the_axis_stands() -> None:
    bench = moving()
    bench.write(0x60FB, 10.0, 1)
    bench.write(0x6040, HALT)
    for _ in range(2000):
        bench.sync()
        if int(bench.read(0x6041)) & 1 << 10:
            break
    assert abs(motor_speed(bench)) < STANDSTILL
    assert bench.drive.axis.servo.demand[-1, VELOCITY] == 0.0


def test_an_axis_that_stands_is_switched_off_in_the_next_cycle() -> None:
    bench = DriveBench("scara", "rotate")
    bench.enable(PROFILE_VELOCITY)
    bench.sync(50)
    bench.command(SWITCH_ON)
    assert bench.state is State.SWITCHED_ON


def test_an_oscillating_axis_is_let_go() -> None:
    """A position gain far beyond stability: it never stands, and the stop ends after its patience."""
    bench = moving()
    bench.write(0x60FB, 5000.0, 1)
    bench.write(0x6040, SWITCH_ON)
    cycles = cycles_to(bench, State.SWITCHED_ON)
    assert abs(motor_speed(bench)) > STANDSTILL
    assert PATIENCE <= cycles * CYCLE <= PATIENCE + 1.0


@pytest.mark.parametrize("option", [2, 3])
def test_an_axis_without_torque_is_let_go(option: int) -> None:
    """6072h = 0 on a stage without friction: by a ramp or at the current limit, nothing slows it down."""
    bench = moving()
    bench.write(0x605A, option)
    bench.write(0x6072, 0)
    bench.write(0x6040, QUICK_STOP)
    assert cycles_to(bench, State.SWITCH_ON_DISABLED) * CYCLE == pytest.approx(PATIENCE + SPEED / RAMP, abs=0.1)


@pytest.mark.parametrize("controlword", [QUICK_STOP, SHUTDOWN, SWITCH_ON, HALT])
@pytest.mark.parametrize("cycles", [1, 3, 20, 80, 150])
def test_a_stop_after_a_jump_starts_from_what_the_axis_does(controlword: int, cycles: int) -> None:
    """607Ah jumps by 40 rad with no following-error limit: the stop takes v²/2a of the axis' own v, not of the demand's."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x605B, 1)
    for index in (0x6084, 0x6085):
        bench.write(index, bench.units(RAMP))
    bench.enable(CYCLIC)
    bench.sync(5)
    bench.write(0x607A, bench.units(40.0))
    bench.sync(cycles)
    start, speed = bench.motor, float(bench.drive.axis.servo.state["velocity"])
    assert speed == pytest.approx(motor_speed(bench), rel=0.3, abs=10.0)  # as measured, through its filter
    bench.write(0x6040, controlword)
    bench.sync()
    assert abs(bench.drive.axis.servo.demand[:, VELOCITY]).max() <= abs(speed)
    bench.sync(1500)
    assert abs(bench.joint_velocity) < 1e-6
    assert bench.motor - start == pytest.approx(speed**2 / (2.0 * RAMP), rel=0.05, abs=0.05)


def test_a_stop_does_not_let_a_held_load_sag() -> None:
    """Halt at rest holds what was demanded: with P loops each halt would else cost the load another following error."""
    bench = DriveBench("arm", "shoulder")
    bench.drive.axis.servo.parameters["integral_rate"] = 0.0
    bench.enable(CYCLIC)
    bench.write(0x607A, bench.read(0x6064))
    bench.sync(1500)
    held = bench.joint
    for _ in range(5):
        bench.command(HALT)
        bench.sync(200)
        bench.write(0x607A, bench.read(0x6062))
        bench.command(ENABLE)
        bench.sync(200)
    assert bench.joint == pytest.approx(held, abs=1e-4)
    bench.command(DISABLE_VOLTAGE)


def test_standstill_is_not_remembered_from_before_the_voltage_was_off() -> None:
    """An axis that stood enabled is pushed while it has no voltage, and then enabled and disabled at once: it ramps down."""
    bench = moving()
    bench.write(0x60FF, 0)
    bench.sync(500)
    bench.command(DISABLE_VOLTAGE)
    bench.virtual.plant.data.qvel[0] = SPEED / bench.configuration.gear_ratio
    bench.sync(3)
    bench.command(SHUTDOWN, SWITCH_ON, ENABLE)
    bench.write(0x6040, SWITCH_ON)
    assert cycles_to(bench, State.SWITCHED_ON) * CYCLE >= 0.9 * SPEED / RAMP
    assert abs(motor_speed(bench)) < STANDSTILL
