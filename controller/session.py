"""Drives that are enabled and stream: move them, capture what they do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
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
from controller.pacing import Pacing
from controller.progress import Progress
from controller.stop import stopped_at_the_end
from controller.trajectory import move, side_by_side
from drive_profiles import DriveProfile
from drivetwin.recording.recording import AxisInfo, Recording

OVERSHOOT_TIME = 0.02
"""How far an axis may leave its travel before all are stopped, as time at its full speed [s]."""


@dataclass(frozen=True)
class Streaming:
    """What every drive is sent: a set-point and a torque offset each `period` [s], and a velocity offset besides or not.

    Three axes fill a cycle of 1 ms on 1 Mbit/s; with a velocity offset they take 1.15 ms.
    """

    period: float = 0.001
    velocity_offset: bool = False


@dataclass
class Session:
    """Drives that are enabled and stream."""

    cycle: Cycle
    drives: Sequence[DriveNode]
    machine: Machine
    axes: dict[str, AxisInfo]
    progress: Progress

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
        """Stream positions (n, axes) [m or rad] with their offsets and record every axis."""
        self.progress.phase(name.replace("_", " "), len(demand) * self.cycle.period)
        start = positions_now(self.drives)
        samples = stream(self.cycle, self.drives, demand, offsets, self._advance)
        shown = position_demand(self.drives, start, demand)
        return record(name, self.machine.machine, self.cycle.period, self.axes, shown, samples)

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
    voltage afterwards.
    """
    with Link(bus) as link, BusLog(log, str(bus.channel_info), pacing.time) as bus_log:
        link.log = bus_log.frame
        drives = connect(link, machine, profile)
        cycle = Cycle(link, drives, pacing, streaming.period)
        for drive in drives:
            drive.velocity_offset = 0 if streaming.velocity_offset else None
        progress.phase("bring up", 0.1)
        bring_up(link, drives, cycle.period)
        pacing.check(link, drives[0])
        if limits is not None:
            apply_torque_limits(drives, limits)
        session = Session(cycle, drives, machine, describe(drives), progress)
        cycle.start()
        with stopped_at_the_end(cycle, drives):
            _start(session)
            yield session


def _start(session: Session) -> None:
    session.progress.phase("home", 5.0)
    home(session.cycle, session.drives)
    enable_streaming(session.cycle, session.drives)
    session.go_to({name: axis.rest for name, axis in session.machine.axes.items()})
    for drive in session.drives:
        margin = drive.axis.max_speed * OVERSHOOT_TIME
        drive.stay_within(drive.axis.travel[0] - margin, drive.axis.travel[1] + margin)
