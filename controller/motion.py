"""Moving the drives: enable, home, stream set-points, stop. Every timeout is counted in cycles, never in wall-clock time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import (
    FAULT,
    OPERATION_ENABLED,
    READY_TO_SWITCH_ON,
    SWITCH_ON_DISABLED,
    SWITCHED_ON,
    DriveNode,
)
from drivetwin.foundation.errors import UserError

SHUTDOWN, SWITCH_ON, ENABLE_OPERATION, QUICK_STOP, DISABLE_VOLTAGE = 0x06, 0x07, 0x0F, 0x02, 0x00
FAULT_RESET = 0x80
MODE_BIT_4 = 0x10

HOMING_MODE, PROFILE_VELOCITY_MODE = 6, 3
LIMIT_SWITCH_METHODS = {17: -1, 18: 1}
"""Homing methods (6098h) whose home position is the edge of a limit switch, and the way that leads into it."""
HOMING_ATTAINED, HOMING_ERROR, TARGET_REACHED = 1 << 12, 1 << 13, 1 << 10

STATE_TIMEOUT = 1.0
"""Simulated or real seconds that a state change may take (a quick-stop ramp included)."""


@dataclass(frozen=True)
class Offsets:
    """What is streamed beside the positions, a row a cycle, (n, axes), joint side.

    `torque` [N·m or N] (60B2h); `velocity` [rad/s or m/s] (60B1h) for drives that were told to take one.
    """

    torque: NDArray[np.float64]
    velocity: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Samples:
    """What came back while streaming: (n, axes) position [m or rad] and torque [N·m or N], joint side."""

    position: NDArray[np.float64]
    torque: NDArray[np.float64]


def enable(cycle: Cycle, drives: Sequence[DriveNode], mode: int) -> None:
    """Take every drive to operation enabled in `mode`, holding where it stands.

    A drive that is enabled changes its mode with voltage on: an axis under gravity must not sag in between.
    Raises UserError where a drive does not follow the state machine.
    """
    hold(cycle, [drive for drive in drives if drive.streaming])
    cycle.run()
    _switch_mode(cycle, [drive for drive in drives if drive.operating], mode)
    _start_up(cycle, [drive for drive in drives if not drive.operating], mode)


def _switch_mode(cycle: Cycle, drives: Sequence[DriveNode], mode: int) -> None:
    for drive in drives:
        drive.setpoint = drive.position
        drive.clear_offsets()
        drive.controlword = ENABLE_OPERATION
        drive.write(mode, 0x6060)
    cycle.run()
    _check_modes(drives, mode)


def _check_modes(drives: Sequence[DriveNode], mode: int) -> None:
    for drive in drives:
        shown = int(drive.read(0x6061))
        if shown != mode:
            raise UserError(f"{drive.where()} was commanded to mode {mode} (6060h) and shows mode {shown} (6061h)")


def _start_up(cycle: Cycle, drives: Sequence[DriveNode], mode: int) -> None:
    for drive in drives:
        drive.controlword = FAULT_RESET if drive.state == FAULT else DISABLE_VOLTAGE
    _await_state(cycle, drives, SWITCH_ON_DISABLED)
    for drive in drives:
        drive.write(mode, 0x6060)
        drive.clear_offsets()
    _check_modes(drives, mode)
    for word, state in ((SHUTDOWN, READY_TO_SWITCH_ON), (SWITCH_ON, SWITCHED_ON), (ENABLE_OPERATION, OPERATION_ENABLED)):
        for drive in drives:
            drive.setpoint = drive.position  # an axis must not jump to a set-point of former times
            drive.controlword = word
        _await_state(cycle, drives, state)
    for drive in drives:
        drive.operating = True


def enable_streaming(cycle: Cycle, drives: Sequence[DriveNode]) -> None:
    """Operation enabled in each drive's streaming mode, following its set-point (interpolated position needs bit 4).

    Each begins where it stands, but for one on the limit switch that it was homed at.
    """
    enable(cycle, drives, drives[0].profile.streaming_mode)
    for drive in drives:
        drive.setpoint = first_setpoint(drive, cycle.period)
    follow(cycle, drives)


def first_setpoint(drive: DriveNode, period: float) -> int:
    """Where an axis stands [user units]; a step out of the limit switch where it is on that, having been homed at its edge.

    Another axis that braked may have pushed it back and still do: where it was a cycle ago is then a set-point further into the
    switch, and its drive would trip (EMCY 5442h or 5443h). The step is what the axis does in a cycle at the speed of homing.
    """
    homing = drive.axis.homing
    inwards = LIMIT_SWITCH_METHODS.get(homing.method)
    if inwards is None or not drive.homed:
        return drive.position
    behind = inwards * (drive.position - drive.in_units(homing.switch_position))
    return drive.position - inwards * min(max(behind, 0), drive.in_units(homing.search_speed * period))


def follow(cycle: Cycle, drives: Sequence[DriveNode]) -> None:
    """From now on enabled drives in their streaming mode get a set-point each cycle, the first where they are held."""
    for drive in drives:
        drive.controlword = ENABLE_OPERATION | MODE_BIT_4
        drive.follow()
    cycle.run()


def hold(cycle: Cycle, drives: Sequence[DriveNode]) -> None:
    """Drives that stand at their last set-point stay there, without a new one each cycle: that leaves the bus room for SDO."""
    for drive in drives:
        drive.streaming = False
        drive.controlword = ENABLE_OPERATION
    if drives:
        cycle.run()


def disable(cycle: Cycle, drives: Sequence[DriveNode]) -> None:
    """Quick-stop and take the voltage off.

    Raises UserError where a drive does not follow the state machine.
    """
    for drive in drives:
        drive.operating = drive.streaming = False
        drive.clear_offsets()
        drive.controlword = QUICK_STOP
    _await_state(cycle, drives, SWITCH_ON_DISABLED)
    for drive in drives:
        drive.controlword = DISABLE_VOLTAGE
    cycle.run()


def home(cycle: Cycle, drives: Sequence[DriveNode], timeout: float = 60.0) -> None:
    """Home all axes at once; positions are the model's joint positions afterwards.

    Raises UserError naming the axes that did not get there.
    """
    for drive in drives:
        homing = drive.axis.homing
        drive.write(homing.method, 0x6098)
        drive.write(drive.in_units(homing.search_speed), 0x6099, 1)
        drive.write(drive.in_units(homing.edge_speed), 0x6099, 2)
        drive.write(drive.ramp(homing.acceleration), 0x609A)
        drive.write(drive.in_units(-homing.switch_position), 0x607C)  # zero position = home position + home offset
        drive.homed = False
    enable(cycle, drives, HOMING_MODE)
    for drive in drives:
        drive.controlword = ENABLE_OPERATION | MODE_BIT_4
    cycle.run_for(0.01)
    for _ in range(round(timeout / cycle.period)):
        if failed := [drive.where() for drive in drives if drive.statusword & HOMING_ERROR]:
            raise UserError(f"homing error on {', '.join(failed)}: can the axis reach its switch, and has it such a method?")
        if all(drive.statusword & HOMING_ATTAINED and drive.statusword & TARGET_REACHED for drive in drives):
            break
        cycle.run()
    else:
        waiting = [drive.where() for drive in drives if not drive.statusword & HOMING_ATTAINED]
        raise UserError(f"homing did not end within {timeout:g} s on {', '.join(waiting)}: does the limit switch work?")
    for drive in drives:
        drive.homed = True


def stream(
    cycle: Cycle,
    drives: Sequence[DriveNode],
    positions: NDArray[np.float64],
    offsets: Offsets | None = None,
    progress: Callable[[int], None] | None = None,
) -> Samples:
    """Stream joint positions (n, axes) [m or rad] and offsets, one row a cycle, and return what came back.

    Row k of the samples was taken at the SYNC at which row k of the set-points took effect; the drive's position demand
    reaches that set-point `DriveNode.setpoint_delay` cycles later, while row k of the offsets acts from that SYNC to the next.
    Afterwards the torque stays as in the last row, and the velocity offset is 0. Raises UserError for a torque that 60B2h
    cannot hold, and for velocities to a drive that was not told to take them.
    """
    setpoints = [[int(value) for value in np.rint(positions[:, axis] / drive.unit)] for axis, drive in enumerate(drives)]
    torques = [[drive.torque_offset] * len(positions) for drive in drives]
    if offsets is not None:
        torques = [drive.torque_offsets(offsets.torque[:, axis]) for axis, drive in enumerate(drives)]
    velocity = offsets.velocity if offsets is not None else None
    if velocity is not None and (deaf := [drive.where() for drive in drives if not drive.takes_velocity_offset]):
        raise UserError(f"{', '.join(deaf)} maps no velocity offset (60B1h): open the session with one")
    raw_position: list[list[int]] = [[] for _ in drives]
    raw_torque: list[list[float]] = [[] for _ in drives]
    streamed = list(zip(drives, setpoints, torques, strict=True))
    sampled = list(zip(drives, raw_position, raw_torque, strict=True))
    for row in range(len(positions)):
        for drive, setpoint, torque in streamed:
            drive.setpoint = setpoint[row]
            drive.torque_offset = torque[row]
        if velocity is not None:
            for axis, drive in enumerate(drives):
                drive.velocity_offset = drive.in_units(velocity[row, axis])
        cycle.run()
        for drive, places, forces in sampled:
            places.append(drive.position)
            forces.append(drive.torque)
        if progress is not None and row % 100 == 99:
            progress(100)
    for drive in drives:
        drive.velocity_offset = 0
    units = np.array([drive.unit for drive in drives])
    gears = np.array([drive.axis.gear_ratio for drive in drives])
    return Samples(_rows(raw_position, len(positions)) * units, _rows(raw_torque, len(positions)) * gears)


def _rows(columns: Sequence[Sequence[float]], count: int) -> NDArray[np.float64]:
    """What came of each axis, `count` values, as (count, axes)."""
    return np.array(columns, dtype=np.float64).reshape(len(columns), count).T.copy()


def positions_now(drives: Sequence[DriveNode]) -> NDArray[np.float64]:
    """Set-points as they stand (axes,) [m or rad]: where the next trajectory starts."""
    return np.array([drive.setpoint * drive.unit for drive in drives])


def _await_state(cycle: Cycle, drives: Sequence[DriveNode], state: int) -> None:
    for _ in range(round(STATE_TIMEOUT / cycle.period)):
        cycle.run()
        if all(drive.state == state for drive in drives):
            return
    stuck = next(drive for drive in drives if drive.state != state)
    raise UserError(
        f"{stuck.where()} did not reach state {state:02X}h within {STATE_TIMEOUT:g} s after controlword "
        f"{stuck.controlword:04X}h; its statusword is {stuck.statusword:04X}h"
    )
