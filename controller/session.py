"""Drives that are enabled and stream: move them, capture what they do."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import can
import numpy as np
from numpy.typing import NDArray

from controller.bring_up import bring_up, connect
from controller.bus_log import BusLog
from controller.capture import describe, position_demand, record
from controller.cycle import Cycle
from controller.drive_node import DriveNode
from controller.excitation import with_held
from controller.limits import Limits, apply_torque_limits
from controller.link import Link
from controller.machine import Machine
from controller.motion import Offsets, enable_streaming, home, positions_now, stream
from controller.motor_check import check_motors
from controller.pacing import Pacing
from controller.progress import Progress
from controller.stop import stopped_at_the_end
from controller.trajectory import move, side_by_side
from drive_profiles import DriveProfile
from drivetwin.errors import UserError
from drivetwin.recording.recording import AxisInfo, Recording

logger = logging.getLogger(__name__)

OVERSHOOT_TIME = 0.02
"""How far an axis may leave its travel before all are stopped, as time at its full speed [s]."""


@dataclass(frozen=True)
class Streaming:
    """What every drive is sent: a set-point and a torque offset each `period` [s], and a velocity offset besides or not.

    Raises UserError for a period that 60C2h cannot hold: it counts milliseconds.
    """

    period: float = 0.001
    velocity_offset: bool = False

    def __post_init__(self) -> None:
        milliseconds = self.period * 1e3
        if milliseconds < 0.5 or abs(milliseconds - round(milliseconds)) > 1e-6:
            raise UserError(f"a cycle of {milliseconds:g} ms cannot be told to a drive: 60C2h counts whole milliseconds")

    def bus_time(self, axes: int) -> float:
        """Seconds that a cycle's frames take on 1 Mbit/s with worst-case stuffing: SYNC, RPDOs and TPDO of each axis."""
        return 1e-6 * (SYNC_BITS + axes * (2 * EIGHT_BYTES + (FOUR_BYTES if self.velocity_offset else 0)))


SYNC_BITS, FOUR_BYTES, EIGHT_BYTES = 55, 95, 135
"""Bits of frames with an 11-bit identifier and worst-case stuffing, interframe space included (docs/bus.md)."""


@dataclass
class Session:
    """Drives that are enabled and stream."""

    cycle: Cycle
    drives: Sequence[DriveNode]
    machine: Machine
    axes: dict[str, AxisInfo]
    progress: Progress
    _before: dict[tuple[str, str], float] = field(default_factory=dict)

    def go_to(self, targets: dict[str, float]) -> None:
        """Move the named axes [m or rad]; the others hold."""
        start = positions_now(self.drives)
        paths = []
        for drive, position in zip(self.drives, start, strict=True):
            target = targets.get(drive.name, float(position))
            axis = drive.axis
            paths.append(move(float(position), target, axis.max_speed, 0.5 * axis.max_acceleration, self.cycle.period))
        stream(self.cycle, self.drives, side_by_side(paths))
        self.cycle.run_for(0.1)

    def capture(self, name: str, paths: dict[str, NDArray[np.float64]]) -> Recording:
        """Stream the paths of the named axes, the others holding, and record every axis."""
        held = dict(zip(self.axes, (float(value) for value in positions_now(self.drives)), strict=True))
        return self.run(name, with_held(paths, held))

    def run(self, name: str, demand: NDArray[np.float64], offsets: Offsets | None = None) -> Recording:
        """Stream positions (n, axes) [m or rad] with their offsets and record every axis.

        Raises UserError where the path does not begin where the axes are: no axis may leap there.
        """
        self.progress.phase(name.replace("_", " "), len(demand) * self.cycle.period)
        start = positions_now(self.drives)
        self._refuse_leap(name, start, demand[0])
        samples = stream(self.cycle, self.drives, demand, offsets, self._advance)
        shown = position_demand(self.drives, start, demand)
        return record(name, self.machine.machine, self.cycle.period, self.axes, shown, samples, offsets)

    def set_parameter(self, name: str, value: float) -> None:
        """Set a quantity of every drive [SI, motor side] until the session ends, when what was there before is put back.

        Raises UserError where a drive type does not have it, or refuses it.
        """
        for drive in self.drives:
            role = drive.role(name)
            if role is None:
                raise UserError(f"{drive.where()}: drives of type {drive.profile.name} have no {name} to set")
            self._before.setdefault((drive.name, name), float(drive.read(role.index, role.subindex)))
            drive.write(value / role.si_per_unit, role.index, role.subindex)
        self.axes = describe(self.drives)

    def put_back(self) -> None:
        """Every drive's parameters as they were before; one that cannot be reached is told, and does not hold up the others."""
        for drive in self.drives:
            for name in [name for axis, name in self._before if axis == drive.name]:
                raw = self._before.pop((drive.name, name))
                role = drive.profile.roles[name]
                try:
                    drive.write(raw, role.index, role.subindex)
                except UserError as error:
                    logger.warning("%s keeps a changed %s, %g before: %s", drive.where(), name, raw, error)

    def _refuse_leap(self, name: str, start: NDArray[np.float64], first: NDArray[np.float64]) -> None:
        for drive, stands, begins in zip(self.drives, start.tolist(), first.tolist(), strict=True):
            if abs(begins - stands) > 1.01 * drive.axis.max_speed * self.cycle.period + drive.unit:
                raise UserError(
                    f"'{name}' begins at {begins:.6g} on {drive.where()}, which stands at {stands:.6g}: "
                    "move it there first, a set-point must not leap"
                )

    def _advance(self, cycles: int) -> None:
        self.progress.advance(cycles * self.cycle.period)


@contextmanager
def session_on(
    bus: can.BusABC,
    machine: Machine,
    profile: DriveProfile,
    pacing: Pacing,
    limits: Limits | None,
    progress: Progress,
    log: Path,
    streaming: Streaming = Streaming(),
) -> Iterator[Session]:
    """The machine on `bus` brought up, homed, at rest and streaming; every frame goes to the candump log `log`.

    Raises UserError for whatever the bench has to set right. However the block ends, every axis is stopped and without
    voltage afterwards, and has its own parameters again.
    """
    with Link(bus) as link, BusLog(log, str(bus.channel_info), pacing.time) as bus_log:
        link.log = bus_log.frame
        drives = connect(link, machine, profile)
        _refuse_overload(streaming, len(drives))
        cycle = Cycle(link, drives, pacing, streaming.period)
        for drive in drives:
            drive.takes_velocity_offset = streaming.velocity_offset
        progress.phase("bring up", 0.1)
        bring_up(link, drives, cycle.period)
        pacing.check(link, drives[0])
        check_motors(drives, machine)
        if limits is not None:
            apply_torque_limits(drives, limits)
        session = Session(cycle, drives, machine, describe(drives), progress)
        cycle.start()
        try:
            with stopped_at_the_end(cycle, drives):
                _start(session)
                yield session
        finally:
            session.put_back()


def _refuse_overload(streaming: Streaming, axes: int) -> None:
    needed = streaming.bus_time(axes)
    if needed > streaming.period:
        raise UserError(
            f"{axes} axes take {needed * 1e3:.3g} ms of 1 Mbit/s and the cycle has {streaming.period * 1e3:g} ms: "
            "take a longer cycle, or no velocity offset"
        )


def _start(session: Session) -> None:
    session.progress.phase("home", 5.0)
    home(session.cycle, session.drives)
    enable_streaming(session.cycle, session.drives)
    session.go_to({name: axis.rest for name, axis in session.machine.axes.items()})
    for drive in session.drives:
        margin = drive.axis.max_speed * OVERSHOOT_TIME
        drive.stay_within(drive.axis.travel[0] - margin, drive.axis.travel[1] + margin)
