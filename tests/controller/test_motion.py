"""Enabling, homing, streaming and stopping, judged by the virtual machine's own state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from virtual_bench import VirtualBench

from drivetwin.controller import link as link_module
from drivetwin.controller.motion import Offsets, disable, enable_streaming, first_setpoint, home, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.sdo_check import friction_by_sdo
from drivetwin.controller.stop import stopped_at_the_end
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.controller.trouble import DriveFaultError
from drivetwin.emulator.drive.state_machine import State
from drivetwin.foundation.errors import InterruptedByUserError, UserError

STILL = 1e-3
"""A joint that is slower than this stands [rad/s or m/s]."""


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Lockstep, "first_answer", 0.02)
    monkeypatch.setattr(Lockstep, "further_answer", 0.02)
    monkeypatch.setattr(link_module.PumpedSdoClient, "RESPONSE_TIMEOUT", 0.02)


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_after_homing_positions_are_those_of_the_joints(profile: str) -> None:
    bench = VirtualBench("scara", profile).up()
    home(bench.cycle, bench.drives)
    bench.cycle.run_for(0.2)
    told = [drive.position * drive.unit for drive in bench.drives]
    np.testing.assert_allclose(told, bench.virtual.plant.joint_positions(), atol=2e-4)


def test_homing_that_cannot_end_says_which_axis() -> None:
    bench = VirtualBench().up()
    object.__setattr__(bench.virtual.drives[0].axis.switches, "low", -1e9)
    bench.virtual.drives[0].dictionary[0x22E7].store(0)
    with pytest.raises(UserError, match=r"homing did not end within 0.5 s on axis slide \(node 1\): does the limit"):
        home(bench.cycle, bench.drives, timeout=0.5)


def streamed(profile: str, step: float, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and torques of a stage that stands and gets one step at `row` of the set-points."""
    bench = VirtualBench("stage", profile).up()
    enable_streaming(bench.cycle, bench.drives)
    bench.cycle.run_for(0.2)
    demand = np.full((40, 1), positions_now(bench.drives)[0])
    demand[row:] += step
    samples = stream(bench.cycle, bench.drives, demand)
    return samples.position[:, 0], samples.torque[:, 0]


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_row_k_was_sampled_at_the_sync_at_which_set_point_k_took_effect(profile: str) -> None:
    """Two runs are bit-identical until a set-point that differs acts: its own sample cannot know, the next one does."""
    row = 17
    position, torque = streamed(profile, 0.0, row)
    stepped_position, stepped_torque = streamed(profile, 2e-4, row)
    np.testing.assert_array_equal(stepped_position[: row + 1], position[: row + 1])
    np.testing.assert_array_equal(stepped_torque[: row + 1], torque[: row + 1])
    assert stepped_torque[row + 1] > torque[row + 1]
    assert stepped_position[-1] - position[-1] > 1e-5


def test_streaming_follows_and_converts_to_the_joint() -> None:
    bench = VirtualBench("arm").up()
    home(bench.cycle, bench.drives)
    enable_streaming(bench.cycle, bench.drives)
    path = move(float(positions_now(bench.drives)[0]), 0.5, 1.0, 4.0, bench.cycle.period)
    samples = stream(bench.cycle, bench.drives, path[:, None])
    bench.cycle.run_for(0.5)
    assert bench.virtual.plant.joint_positions()[0] == pytest.approx(0.5, abs=1e-4)
    assert np.abs(samples.position[:, 0] - path).max() < 0.02
    # held against gravity: what the drive tells, its sensor's noise averaged, is the joint's load, stiction aside
    standing = np.repeat(positions_now(bench.drives)[None, :], 200, axis=0)
    torque = float(stream(bench.cycle, bench.drives, standing).torque.mean())
    model, data = bench.virtual.plant.model, bench.virtual.plant.data
    load = float(data.qfrc_bias[0])
    assert model.nv == 1
    assert torque == pytest.approx(load, abs=2.2 + 0.05)


@pytest.mark.parametrize(
    ("method", "homed", "at", "step"),
    [
        (17, True, -5.0, 0.08),
        (17, True, -0.05, 0.05),
        (17, True, 5.0, 0.0),
        (18, True, 5.0, -0.08),
        (18, True, -5.0, 0.0),
        (19, True, -5.0, 0.0),
        (17, False, -5.0, 0.0),
    ],
    ids=["negative", "just on it", "off it", "positive", "off the positive", "another switch", "not homed"],
)
def test_the_first_set_point_leads_a_step_out_of_the_limit_switch(method: int, homed: bool, at: float, step: float) -> None:
    """The SCARA's lift, homed at 0.08 m/s: 80 um a cycle at most, wherever from the edge it stands [mm]."""
    drive = VirtualBench("scara").drives[0]
    homing = drive.axis.homing.model_copy(update={"method": method})
    drive.axis = drive.axis.model_copy(update={"homing": homing})
    drive.homed = homed
    drive.position = drive.in_units(homing.switch_position + 1e-3 * at)
    assert (first_setpoint(drive, 0.001) - drive.position) * drive.unit == pytest.approx(1e-3 * step, abs=drive.unit)


def moving(machine: str, profile: str = "servoone") -> VirtualBench:
    """Axes that are homed, enabled and under way."""
    bench = VirtualBench(machine, profile).up()
    home(bench.cycle, bench.drives)
    enable_streaming(bench.cycle, bench.drives)
    return bench


def go(bench: VirtualBench, trouble: Callable[[], None]) -> None:
    """Move all axes towards the middle; `trouble` strikes at a third of the way, at speed."""
    paths = []
    for drive, start in zip(bench.drives, positions_now(bench.drives), strict=True):
        axis = drive.axis
        middle = 0.5 * (axis.travel[0] + axis.travel[1])
        paths.append(move(float(start), middle, 0.6 * axis.max_speed, 0.5 * axis.max_acceleration, bench.cycle.period))
    path = side_by_side(paths)
    shortest = min(len(each) for each in paths)

    def struck(_rows: int) -> None:
        if not done and bench.cycle.count - started > shortest // 3:
            done.append(True)
            assert min(abs(speed) for speed in bench.speeds()) > 10 * STILL
            trouble()

    started = bench.cycle.count
    done: list[bool] = []
    stream(bench.cycle, bench.drives, path, progress=struck)


def comes_to_rest(bench: VirtualBench) -> bool:
    """Whether the joints stand soon: a drive ends its ramp with the demand, and what still turns is stopped by friction."""
    bench.cycle.run_for(0.1)
    return max(abs(speed) for speed in bench.speeds()) < STILL


def strike(bench: VirtualBench, trouble: Callable[[], None]) -> None:
    with stopped_at_the_end(bench.cycle, bench.drives):
        go(bench, trouble)


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_interruption_quick_stops_and_disables_every_axis(profile: str) -> None:
    bench = moving("scara", profile)

    def interrupt() -> None:
        bench.sent.clear()
        raise KeyboardInterrupt

    with pytest.raises(InterruptedByUserError, match=r"^interrupted; every axis was stopped and is without voltage$"):
        strike(bench, interrupt)
    assert bench.states() == [State.SWITCH_ON_DISABLED] * 3
    assert comes_to_rest(bench)
    words = [frame.data[0] for frame in bench.sent if frame.arbitration_id == 0x202]
    assert words[0] == 0x02, "quick stop comes first"
    assert words[-1] == 0x00


def test_other_errors_stop_the_axes_and_stay_what_they_are() -> None:
    bench = moving("scara")

    def fail() -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        strike(bench, fail)
    assert bench.states() == [State.SWITCH_ON_DISABLED] * 3


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_a_fault_of_one_drive_stops_all(profile: str) -> None:
    bench = moving("scara", profile)

    def fault() -> None:
        bench.virtual.drives[1].fault(0x7500)

    with pytest.raises(DriveFaultError, match=r"axis rotate \(node 2\) reports EMCY 7500h .*; every axis was stopped"):
        strike(bench, fault)
    assert bench.states() == [State.SWITCH_ON_DISABLED, State.FAULT, State.SWITCH_ON_DISABLED]
    assert comes_to_rest(bench)


def test_a_drive_that_falls_silent_does_not_keep_the_others_moving() -> None:
    bench = moving("scara")
    with pytest.raises(
        UserError,
        match=r"axis rotate \(node 2\) sent no PDO.*; NOT KNOWN TO BE STOPPED: axis rotate \(node 2\); every other axis was",
    ):
        strike(bench, lambda: bench.silent.add(2))
    states = bench.states()
    assert (states[0], states[2]) == (State.SWITCH_ON_DISABLED, State.SWITCH_ON_DISABLED)
    assert states[1] is State.SWITCH_ON_DISABLED, "it still hears, though it does not answer"


def test_a_drive_that_hears_and_says_nothing_more_does_not_either() -> None:
    bench = moving("scara")

    def die() -> None:
        bench.silent.add(1)
        bench.virtual.drives[0].device.receive = lambda *_: None  # type: ignore[method-assign]
        bench.virtual.drives[0].device.sync = lambda *_: None  # type: ignore[method-assign]

    with pytest.raises(UserError, match=r"NOT KNOWN TO BE STOPPED: axis lift \(node 1\)"):
        strike(bench, die)
    assert bench.states()[1:] == [State.SWITCH_ON_DISABLED] * 2


def test_a_bus_that_is_lost_is_told_as_such() -> None:
    bench = moving("scara")

    def lose() -> None:
        def lost(*_: object) -> None:
            raise UserError("the bus has gone")

        bench.link.send = lost  # type: ignore[method-assign, assignment]

    with pytest.raises(UserError, match=r"the bus has gone; NOT KNOWN TO BE STOPPED: .*lift.*rotate.*stretch"):
        strike(bench, lose)


def test_the_end_of_good_work_is_without_voltage_too() -> None:
    bench = moving("stage")
    with stopped_at_the_end(bench.cycle, bench.drives):
        go(bench, lambda: None)
    assert bench.states() == [State.SWITCH_ON_DISABLED]


def test_a_second_fault_while_stopping_is_survived() -> None:
    bench = moving("scara")

    def faults() -> None:
        bench.virtual.drives[1].fault(0x7500)
        bench.virtual.drives[2].fault(0x2310)

    with pytest.raises(DriveFaultError):
        strike(bench, faults)
    assert bench.states() == [State.SWITCH_ON_DISABLED, State.FAULT, State.FAULT]


def test_a_drive_in_fault_at_the_start_is_reset_and_used() -> None:
    bench = VirtualBench("scara").up()
    bench.virtual.drives[0].fault(0x8611)
    with pytest.raises(DriveFaultError):
        bench.cycle.run()
    enable_streaming(bench.cycle, bench.drives)
    assert bench.states() == [State.OPERATION_ENABLED] * 3
    disable(bench.cycle, bench.drives)


def test_torque_polled_by_sdo_is_the_friction_of_the_plant() -> None:
    bench = moving("stage")
    path = move(float(positions_now(bench.drives)[0]), 0.0, 0.2, 1.0, bench.cycle.period)
    stream(bench.cycle, bench.drives, path[:, None])
    truth = bench.virtual.plant.truth()["slide"]
    for point in friction_by_sdo(bench.cycle, bench.drives):
        law = truth["coulomb"] + truth["viscous"] * point.velocity
        assert point.torque == pytest.approx(law, rel=0.05)


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_the_torque_offset_is_what_the_motor_gives_more(profile: str) -> None:
    """Row k of the offsets acts from SYNC k on: the next sample has it, less what the current loop lags."""
    torques = []
    row, size = 20, 30.0
    for height in (0.0, size):
        bench = VirtualBench("stage", profile).up()
        enable_streaming(bench.cycle, bench.drives)
        bench.cycle.run_for(0.2)
        demand = np.full((40, 1), positions_now(bench.drives)[0])
        offsets = np.zeros((40, 1))
        offsets[row:] = height
        torques.append(stream(bench.cycle, bench.drives, demand, Offsets(offsets)).torque[:, 0])
    np.testing.assert_array_equal(torques[0][: row + 1], torques[1][: row + 1])
    lag = bench.virtual.machine.axes["slide"].current_loop_time_constant
    assert torques[1][row + 1] - torques[0][row + 1] == pytest.approx(size * (1.0 - np.exp(-0.001 / lag)), rel=0.15)


def test_a_torque_offset_beyond_16_bits_is_refused() -> None:
    bench = VirtualBench("stage").up()
    enable_streaming(bench.cycle, bench.drives)
    demand = np.full((5, 1), positions_now(bench.drives)[0])
    with pytest.raises(UserError, match=r"axis slide \(node 1\): a torque offset of 1e\+06 is beyond the .* of 60B2h"):
        stream(bench.cycle, bench.drives, demand, Offsets(np.full((5, 1), 1e6)))
