"""Enabled, streaming drives: move them and capture their motion."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path

import can
import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.bus_log import BusLog
from drivetwin.controller.capture import describe, position_demand, record
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.error_control import BEAT_EVERY, NODE_BEATS_EVERY, release_error_control
from drivetwin.controller.excitation import with_held
from drivetwin.controller.joint_path import limits_of
from drivetwin.controller.limits import Limits
from drivetwin.controller.link import Link
from drivetwin.controller.machine import Machine
from drivetwin.controller.motion import Offsets, enable_streaming, follow, hold, home, positions_now, stream
from drivetwin.controller.motor_check import check_motors
from drivetwin.controller.pacing import Found, Pacing
from drivetwin.controller.progress import Progress
from drivetwin.controller.stop import stopped_at_the_end
from drivetwin.controller.synchronised import synchronised
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.controller.trouble import TroubleError
from drivetwin.drive_profiles import DriveProfile
from drivetwin.foundation.collector import without_collector
from drivetwin.foundation.errors import UserError
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
            raise UserError(f"a cycle of {milliseconds:g} ms cannot be set in a drive: 60C2h counts whole milliseconds")

    def bus_time(self, axes: int) -> float:
        """Seconds that a cycle's frames take on 1 Mbit/s with worst-case stuffing: SYNC, RPDOs and TPDO of each axis, and a
        cycle's share of the heartbeats. There is no SDO while axes follow set-points.
        """
        heartbeats = ONE_BYTE * self.period * (axes / NODE_BEATS_EVERY + 1.0 / BEAT_EVERY)
        return 1e-6 * (SYNC_BITS + axes * (2 * EIGHT_BYTES + (FOUR_BYTES if self.velocity_offset else 0)) + heartbeats)


MOST_LOAD = 0.8
"""Share of the bus that frames of every cycle may take by plan: the rest is for what nobody has planned."""


def roomy(streaming: Streaming, axes: int) -> Streaming:
    """The same with the shortest cycle of whole milliseconds, not below the one given, in which no more than `MOST_LOAD` is
    taken."""
    while streaming.bus_time(axes) > MOST_LOAD * streaming.period:
        streaming = replace(streaming, period=streaming.period + 0.001)
    return streaming


SYNC_BITS, ONE_BYTE, FOUR_BYTES, EIGHT_BYTES = 55, 65, 95, 135
"""Bits of frames with an 11-bit identifier and worst-case stuffing, interframe space included (docs/bus.md)."""


@dataclass
class Session:
    """Drives that are enabled and stream."""

    cycle: Cycle
    drives: Sequence[DriveNode]
    machine: Machine
    axes: dict[str, AxisInfo]
    progress: Progress
    link: Link
    limits: Limits | None = None
    _before: dict[tuple[str, str], float] = field(default_factory=dict)

    def ready(self) -> None:
        """Home every axis that does not know its zero; then let all of them stream, within their travel.

        Raises UserError as `home` and `enable_streaming`.
        """
        if strangers := [drive for drive in self.drives if not drive.homed]:
            self.home(strangers)
        if not all(drive.streaming for drive in self.drives):
            self.stream_from_here()

    def configure(self, drives: Sequence[DriveNode]) -> None:
        """Bring drives up, after power-on or anew, and see that they are this machine's. Raises UserError as `bring_up`."""
        bring_up(self.link, drives, self.cycle.period, self.limits)
        check_motors(drives, self.machine)
        self.axes |= describe(drives)
        for drive in drives:
            loops = self.axes[drive.name].drive
            limit = loops.torque_limit if loops is not None else None
            drive.torque_limit = drive.motor_torque(limit) if limit else inf

    def home(self, drives: Sequence[DriveNode]) -> None:
        """Home some axes; no travel is watched until they stream."""
        self.progress.phase("home", 5.0)
        for drive in drives:
            drive.allowed = None
        home(self.cycle, drives)

    def stream_from_here(self) -> None:
        """Let every axis follow set-points from where it stands, once it is within its travel."""
        enable_streaming(self.cycle, self.drives)
        self.go_to(self._into_travel())
        for drive in self.drives:
            margin = drive.axis.max_speed * OVERSHOOT_TIME
            drive.stay_within(drive.axis.travel[0] - margin, drive.axis.travel[1] + margin)

    def _into_travel(self) -> dict[str, float]:
        """Where axes that stand outside their travel, as beside a limit switch, get into it."""
        targets = {}
        for drive, position in zip(self.drives, positions_now(self.drives).tolist(), strict=True):
            low, high = drive.axis.travel
            if not low <= position <= high:
                targets[drive.name] = low if position < low else high
        return targets

    @contextmanager
    def holding(self) -> Iterator[None]:
        """All axes stand at their set-points meanwhile without getting new ones: there is room on the bus for SDO."""
        held = [drive for drive in self.drives if drive.streaming]
        hold(self.cycle, held)
        yield
        follow(self.cycle, [drive for drive in held if not drive.streaming])

    def travel(self, targets: dict[str, float]) -> None:
        """Move the named axes [m or rad] together, along a straight line in joint space; the others hold."""
        start = positions_now(self.drives).tolist()
        ends = [targets.get(drive.name, position) for drive, position in zip(self.drives, start, strict=True)]
        way = synchronised(start, ends, [limits_of(drive.axis) for drive in self.drives])
        stream(self.cycle, self.drives, way.sample(self.cycle.period).position)

    def to_rest(self) -> None:
        """Every axis to where it rests (axes.yaml)."""
        self.go_to({name: axis.rest for name, axis in self.machine.axes.items()})

    def meanwhile(self, compute: Callable[[], Found]) -> Found:
        """The result of a computation, during which the axes are held: drives that hear nothing of their controller stop."""
        return self.cycle.meanwhile(compute)

    def wait(self, seconds: float) -> None:
        """Stand at the set-points, which are sent on."""
        self.cycle.run_for(seconds)

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
        lost = self.cycle.missed
        samples = stream(self.cycle, self.drives, demand, offsets, self._advance)
        if self.cycle.missed > lost:
            raise TroubleError(f"'{name}': {self.cycle.missed - lost} PDOs were lost, so it is not a recording of the motion")
        shown = position_demand(self.drives, start, demand)
        return record(name, self.machine.machine, self.cycle.period, self.axes, shown, samples, offsets)

    def set_parameter(self, name: str, value: float) -> None:
        """Set a quantity of every drive [SI, motor side] until the session ends, when what was there before is put back.

        Raises UserError where a drive type does not have it, or refuses it.
        """
        with self.holding():
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
                    "move it there first, a set-point must not jump"
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
    log: Path | None,
    streaming: Streaming = Streaming(),
) -> Iterator[Session]:
    """The machine on `bus` brought up, homed, at rest and streaming; as `machine_on`."""
    with machine_on(bus, machine, profile, pacing, limits, progress, log, streaming) as session:
        session.ready()
        session.to_rest()
        yield session


@contextmanager
def machine_on(
    bus: can.BusABC,
    machine: Machine,
    profile: DriveProfile,
    pacing: Pacing,
    limits: Limits | None,
    progress: Progress,
    log: Path | None,
    streaming: Streaming = Streaming(),
) -> Iterator[Session]:
    """The machine on `bus` brought up and supervised, no axis enabled; every frame goes to the candump log `log`, if any.

    Raises UserError for whatever the bench has to set right, TroubleError for what happens afterwards. However the block ends,
    every axis is stopped and without voltage afterwards, and has its own parameters again.
    """
    with ExitStack() as stack:
        stack.enter_context(without_collector())
        logger.info("cycles run %s", stack.enter_context(pacing.priority()))
        link = stack.enter_context(Link(bus))
        if log is not None:
            link.log = stack.enter_context(BusLog(log, str(bus.channel_info), pacing.time)).frame
        drives = connect(link, machine, profile)
        _refuse_overload(streaming, len(drives))
        cycle = Cycle(link, drives, pacing, streaming.period)
        for drive in drives:
            drive.takes_velocity_offset = streaming.velocity_offset
        progress.phase("bring up", 0.1)
        session = Session(cycle, drives, machine, {}, progress, link, limits)
        session.configure(drives)
        pacing.check(link, drives[0])
        cycle.start()
        try:
            with stopped_at_the_end(cycle, drives):
                yield session
        finally:
            cycle.stop()
            session.put_back()
            release_error_control(drives)


def _refuse_overload(streaming: Streaming, axes: int) -> None:
    needed = streaming.bus_time(axes)
    if needed > streaming.period:
        raise UserError(
            f"{axes} axes take {needed * 1e3:.3g} ms of 1 Mbit/s and the cycle has {streaming.period * 1e3:g} ms: "
            "take a longer cycle, or no velocity offset"
        )
