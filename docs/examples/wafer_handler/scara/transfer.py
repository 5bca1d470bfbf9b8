"""A wafer from one station to another, phase by phase: gentler while the wafer is on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from math import cos, sin

from drivetwin.controller.joint_path import AnyMove, JointPath, joined, slowed
from drivetwin.controller.synchronised import synchronised
from drivetwin.motion.jerk_limited import MotionLimits
from wafer_handler.scara.arm import Arm
from wafer_handler.scara.blade_path import Point, blade_line
from wafer_handler.scara.wafer import Wafer, line_limits, turn_limits, wafer_stretch


class Phase(Enum):
    """What each part of a transfer is for, in their order."""

    APPROACH = "approach"
    PICK = "pick"
    RETRACT = "retract"
    ROTATE = "rotate"
    EXTEND = "extend"
    PLACE = "place"
    WITHDRAW = "withdraw"


@dataclass(frozen=True)
class Station:
    """Where a wafer lies: angle of rotate [rad], distance of its centre from the column [m], height of its underside [m]."""

    angle: float
    reach: float
    height: float


@dataclass(frozen=True)
class Segment:
    """One phase of a transfer, from rest to rest; `loaded` where the wafer is on the blade."""

    phase: Phase
    loaded: bool
    path: JointPath


@dataclass(frozen=True)
class Handler:
    """An arm that carries wafers.

    `line`: limits of the empty blade's straight lines; `clearance` [m]: how far below a station's wafer the blade goes under
    it, and how far above it comes with one; `safety`: least slip margin with a wafer on; `period` [s] of the rows.
    """

    arm: Arm
    wafer: Wafer
    line: MotionLimits
    clearance: float
    safety: float
    period: float

    def transfer(self, source: Station, target: Station) -> tuple[Segment, ...]:
        """The phases that take a wafer from `source` to `target`.

        The blade starts folded before the source, below its wafer, and ends folded before the target, below the wafer that lies
        there now. It is at rest where it touches the wafer and where it leaves it. Raises UserError where a line leaves the
        workspace.
        """
        folded, low, high = self.arm.folded_reach, -self.clearance, self.clearance
        under_source, at_source, over_source = (_at(source, source.reach, above) for above in (low, 0.0, high))
        under_target, at_target, over_target = (_at(target, target.reach, above) for above in (low, 0.0, high))
        return (
            self._empty(Phase.APPROACH, _at(source, folded, low), under_source, at_source),
            self._loaded(Phase.PICK, at_source, over_source),
            self._loaded(Phase.RETRACT, over_source, _at(source, folded, high)),
            self._turn(Phase.ROTATE, source, target),
            self._loaded(Phase.EXTEND, _at(target, folded, high), over_target),
            self._loaded(Phase.PLACE, over_target, at_target),
            self._empty(Phase.WITHDRAW, at_target, under_target, _at(target, folded, low)),
        )

    def _empty(self, phase: Phase, *points: Point) -> Segment:
        lines = [blade_line(self.arm, start, end, self.line, self.period) for start, end in pairwise(points)]
        return Segment(phase, False, joined([line.sample(self.period) for line in lines]))

    def _loaded(self, phase: Phase, start: Point, end: Point) -> Segment:
        gentle = line_limits(self.line, self.wafer, self.safety)
        return self._held(phase, blade_line(self.arm, start, end, gentle, self.period))

    def _turn(self, phase: Phase, source: Station, target: Station) -> Segment:
        start, end = (
            (station.height + self.clearance - self.arm.geometry.height, station.angle, self.arm.travel.stretch[0])
            for station in (source, target)
        )
        lift, rotate, stretch = self.arm.limits
        gentle = turn_limits(rotate, self.wafer, self.arm.folded_reach, self.safety)
        return self._held(phase, synchronised(start, end, (lift, gentle, stretch)))

    def _held(self, phase: Phase, move: AnyMove) -> Segment:
        """`move` with the wafer on, so slow that it does not slip."""

        def stretch(path: JointPath) -> float:
            return wafer_stretch(self.wafer, self.arm.geometry, path, self.safety)

        return Segment(phase, True, slowed(move, self.period, stretch).sample(self.period))


def _at(station: Station, reach: float, above: float) -> Point:
    """The tool point before a station, `above` the height of its wafer [m]."""
    return Point(-reach * sin(station.angle), reach * cos(station.angle), station.height + above)
