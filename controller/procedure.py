"""The identification procedure, from a powered machine to recordings: bring up, home, move, capture, stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import can

from controller.bring_up import bring_up, connect
from controller.bus_log import BusLog
from controller.capture import describe
from controller.cycle import Cycle
from controller.drive_node import DriveNode
from controller.excitation import SPEED_LEVELS, VALIDATION_LEVELS, excitation, strokes
from controller.identification import Settings
from controller.limits import Limits, apply_torque_limits
from controller.link import Link
from controller.machine import Machine
from controller.motion import enable_streaming, home
from controller.pacing import Pacing
from controller.progress import Progress
from controller.sdo_check import FrictionPoint, friction_by_sdo
from controller.session import Session
from controller.stop import stopped_at_the_end
from drive_profiles import DriveProfile
from drivetwin.recording.recording import AxisInfo, Recording

FIT = Settings(cutoff_hz=100.0, reversal_margin=0.03)
"""How these recordings are fitted. At 1 kHz the motion is clean to well above 100 Hz, so the filter smears the strokes' ramps
less than at the 48 Hz of the published EMPS figures; what it does smear, around reversals, is left out. The delay is not
fitted: torque and position come in the same PDO, of the same instant (measured in docs/identification.md)."""

OVERSHOOT_TIME = 0.02
"""How far an axis may leave its travel before all are stopped, as time at its full speed [s]."""


@dataclass
class Captured:
    """What the procedure brings home."""

    recordings: list[Recording] = field(default_factory=list)
    validation: list[Recording] = field(default_factory=list)
    sdo_points: list[FrictionPoint] = field(default_factory=list)
    cycles: int = 0
    late_cycles: int = 0
    worst_lateness: float = 0.0


def capture_machine(
    bus: can.BusABC,
    machine: Machine,
    profile: DriveProfile,
    pacing: Pacing,
    limits: Limits | None,
    seed: int,
    progress: Progress,
    log: Path,
) -> Captured:
    """Run the whole procedure on the machine that answers on `bus`; every frame goes to the candump log `log`.

    Raises UserError for whatever the bench has to set right; every axis is then stopped and without voltage.
    """
    with Link(bus) as link, BusLog(log, str(bus.channel_info), pacing.time) as bus_log:
        link.log = bus_log.frame
        drives = connect(link, machine, profile)
        cycle = Cycle(link, drives, pacing)
        progress.phase("bring up", 0.1)
        bring_up(link, drives, cycle.period)
        pacing.check(link, drives[0])
        if limits is not None:
            apply_torque_limits(drives, limits)
        axes = describe(drives)
        cycle.start()
        with stopped_at_the_end(cycle, drives):
            captured = _capture(cycle, drives, machine, axes, seed, progress)
        captured.cycles = cycle.count
        captured.late_cycles, captured.worst_lateness = pacing.late_cycles, pacing.worst_lateness
        return captured


def _capture(
    cycle: Cycle, drives: Sequence[DriveNode], machine: Machine, axes: dict[str, AxisInfo], seed: int, progress: Progress
) -> Captured:
    progress.phase("home", 5.0)
    home(cycle, drives)
    enable_streaming(cycle, drives)
    session = Session(cycle, drives, machine, axes, progress)
    session.go_to({name: axis.rest for name, axis in machine.axes.items()})
    for drive in drives:
        margin = drive.axis.max_speed * OVERSHOOT_TIME
        drive.stay_within(drive.axis.travel[0] - margin, drive.axis.travel[1] + margin)
    captured = Captured()
    for group in machine.groups:
        _identify_group(session, group, seed, captured)
    return captured


def _identify_group(session: Session, group: Sequence[str], seed: int, captured: Captured) -> None:
    axes = {name: session.machine.axes[name] for name in group}
    period = session.cycle.period
    label = "_".join(group)
    session.go_to({name: 0.5 * (axis.travel[0] + axis.travel[1]) for name, axis in axes.items()})
    paths = {name: strokes(axis, SPEED_LEVELS, period) for name, axis in axes.items()}
    captured.recordings.append(session.capture(f"strokes_{label}", paths))
    paths = {name: excitation(axis, seed, period) for name, axis in axes.items()}
    captured.recordings.append(session.capture(f"excitation_{label}", paths))
    paths = {name: strokes(axis, VALIDATION_LEVELS, period) for name, axis in axes.items()}
    captured.validation.append(session.capture(f"validation_{label}", paths))
    moving = [drive for drive in session.drives if drive.name in group]
    session.progress.phase(f"torque by SDO, {', '.join(group)}", 2.0)
    captured.sdo_points += friction_by_sdo(session.cycle, moving)
    enable_streaming(session.cycle, moving)
    session.go_to({name: axis.rest for name, axis in axes.items()})
