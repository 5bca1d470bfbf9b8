"""The identification procedure, from a powered machine to recordings: bring up, home, move, capture, stop."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import can

from drivetwin.controller.excitation import SPEED_LEVELS, VALIDATION_LEVELS, excitation, strokes
from drivetwin.controller.limits import Limits
from drivetwin.controller.machine import Machine
from drivetwin.controller.motion import enable_streaming
from drivetwin.controller.pacing import Pacing
from drivetwin.controller.progress import Progress
from drivetwin.controller.sdo_check import FrictionPoint, friction_by_sdo
from drivetwin.controller.session import Session, Streaming, roomy, session_on
from drivetwin.drive_profiles import DriveProfile
from drivetwin.identification import Settings
from drivetwin.recording.recording import Recording

logger = logging.getLogger(__name__)

FIT = Settings(cutoff_hz=100.0, reversal_margin=0.03)
"""How these recordings are fitted. At 1 kHz the motion is clean to well above 100 Hz, so the filter smears the strokes' ramps
less than at the 48 Hz of the published EMPS figures; what it does smear, around reversals, is left out. The delay is not
fitted: torque and position come in the same PDO, of the same instant (measured in docs/identification.md)."""


@dataclass
class Captured:
    """What the procedure brings home."""

    recordings: list[Recording] = field(default_factory=list)
    validation: list[Recording] = field(default_factory=list)
    sdo_points: list[FrictionPoint] = field(default_factory=list)
    cycles: int = 0
    period: float = 0.001
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
    streaming = fitting(len(machine.axes))
    with session_on(bus, machine, profile, pacing, limits, progress, log, streaming) as session:
        captured = capture_friction(session, seed)
    captured.cycles, captured.period = session.cycle.count, session.cycle.period
    captured.late_cycles, captured.worst_lateness = pacing.late_cycles, pacing.worst_lateness
    return captured


def fitting(axes: int) -> Streaming:
    """The usual cycle, or where so many axes do not fit into it the shortest that leaves room; said."""
    usual = Streaming()
    if usual.bus_time(axes) <= usual.period:
        return usual
    longer = roomy(usual, axes)
    logger.warning("%d axes do not fit into %g ms of 1 Mbit/s: cycle %g ms", axes, 1e3 * usual.period, 1e3 * longer.period)
    return longer


def capture_friction(session: Session, seed: int) -> Captured:
    """Move and record every group of axes of a machine that is homed and streams."""
    captured = Captured()
    for group in session.machine.groups:
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
    with session.holding():
        captured.sdo_points += friction_by_sdo(session.cycle, moving)
        enable_streaming(session.cycle, moving)
    session.go_to({name: axis.rest for name, axis in axes.items()})
