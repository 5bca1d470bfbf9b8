"""Where the blade truly goes: along a straight line, and with a wafer on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.feedforward.bench import Bench
from drivetwin.controller.feedforward.rest import LEAD_IN, rows_of, with_rest
from drivetwin.controller.feedforward.stage import Stage, feed_velocity
from drivetwin.controller.joint_path import JointPath
from drivetwin.controller.motion import positions_now
from drivetwin.motion.filtering import derivative, zero_phase
from drivetwin.motion.jerk_limited import MotionLimits
from wafer_handler.bench import Seen, Witness
from wafer_handler.results import CarriedPhase, StraightMove
from wafer_handler.scara.arm import Arm
from wafer_handler.scara.blade_path import Point, blade_line, distance_from_line
from wafer_handler.scara.transfer import Handler, Segment, Station
from wafer_handler.scara.wafer import BladeMotion, Wafer, blade_motion, slip_margin

LINE = MotionLimits(speed=1.0, acceleration=5.0, jerk=100.0)
"""Of the empty blade along a line: m/s, m/s², m/s³."""

REACH = (0.36, 0.62)
"""From where to where the stretch move goes [m from the column]."""

WAFER = Wafer(tilt=np.radians(1.0))
"""mu = 0.2 on blade's pads, a blade that may lean by 1 degree."""

SAFETY = 1.5
FROM, TO = Station(angle=0.9, reach=0.60, height=0.95), Station(angle=-0.9, reach=0.55, height=1.0)

RINGS = 0.5
"""How long the belts ring after a move [s]."""

SEEN_TO_HZ = 60.0
"""Up to where the blade's true acceleration is taken from its positions; it includes what the belts ring with, not the
simulation's own steps."""


@dataclass(frozen=True)
class BladeBench:
    """Drives that stream a planned path with feed-forward, and the witness of where the blade truly was."""

    bench: Bench
    witness: Witness
    arm: Arm

    @property
    def period(self) -> float:
        """Of a cycle [s]."""
        return self.bench.session.cycle.period

    def go_to(self, joints: NDArray[np.float64]) -> None:
        """Move to `joints` (3,) and stand until the belts have stopped ringing."""
        self.bench.session.go_to(dict(zip(self.bench.session.axes, joints.tolist(), strict=True)))
        self.bench.session.cycle.run_for(RINGS)

    def run(self, name: str, path: JointPath, stage: Stage) -> Seen:
        """Go through a path; where the blade truly was, one row a row of the path with its rest."""
        resting = with_rest(positions_now(self.bench.session.drives), path)
        offsets = self.bench.offsets(resting, stage)
        self.witness.watch()
        self.bench.session.run(name, resting.position, offsets)
        return self.witness.seen()


def straight_move(blade: BladeBench) -> StraightMove:
    """The blade out along a line at every stage, from the same place."""
    angle = blade.arm.machine.axes["rotate"].rest
    height = blade.arm.geometry.height + blade.arm.machine.axes["lift"].rest
    start, end = (Point(-reach * np.sin(angle), reach * np.cos(angle), height) for reach in REACH)
    line = blade_line(blade.arm, start, end, LINE, blade.period)
    path = line.sample(blade.period)
    off = {}
    for stage in Stage:
        blade.go_to(path.position[0])
        feed_velocity(blade.bench.session, stage.velocity)
        seen = blade.run(f"blade out, {stage.value}", path, stage)
        off[stage] = distance_from_line(start, end, seen.position)[rows_of(LEAD_IN, blade.period) :]
    rows = np.arange(len(off[Stage.TORQUE]))
    return StraightMove(np.asarray(rows * blade.period, dtype=np.float64), off)


def carry_wafer(blade: BladeBench) -> list[CarriedPhase]:
    """A transfer with velocity and torque fed forward; the phases with a wafer on, and how near each came to its slipping."""
    handler = Handler(blade.arm, WAFER, LINE, 0.01, SAFETY, blade.period)
    carried = []
    segments = handler.transfer(FROM, TO)
    blade.go_to(segments[0].path.position[0])
    feed_velocity(blade.bench.session, True)
    for segment in segments:
        seen = blade.run(f"wafer: {segment.phase.value}", segment.path, Stage.TORQUE)
        if segment.loaded:
            carried.append(_carried(blade, segment, seen))
    return carried


def _carried(blade: BladeBench, segment: Segment, seen: Seen) -> CarriedPhase:
    path = segment.path
    return CarriedPhase(
        phase=segment.phase,
        seconds=len(path.position) * path.period,
        planned_margin=float(slip_margin(WAFER, blade_motion(blade.arm.geometry, path)).min()),
        true_margin=float(slip_margin(WAFER, _true_motion(seen, path.period)).min()),
    )


def _true_motion(seen: Seen, period: float) -> BladeMotion:
    """How the blade truly moved, up to `SEEN_TO_HZ`."""

    def acceleration(column: NDArray[np.float64]) -> NDArray[np.float64]:
        return derivative(derivative(zero_phase(column, period, SEEN_TO_HZ), period), period)

    x, y, z = (acceleration(column) for column in seen.position.T)
    return BladeMotion(np.column_stack([x, y, z]), seen.yaw, acceleration(seen.yaw))
