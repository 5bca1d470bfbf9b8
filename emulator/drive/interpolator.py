"""What a mode says of the set-points that an axis follows; the demand between them is filled within the plant's cycle."""

from __future__ import annotations

from drivetwin.emulator.drive.interpolation import Interpolation
from drivetwin.emulator.drive.servo import Servo


class Interpolator:
    """Writes the course of an axis."""

    def __init__(self, servo: Servo) -> None:
        self._course = course = servo.course
        self._kind, self._setpoint, self._interval = course.cell("kind"), course.cell("setpoint"), course.cell("interval")
        self._faster, self._torque = course.cell("faster"), course.cell("torque")
        self._taken = course.cell("p3")

    @property
    def setpoint(self) -> float:
        """The last set-point that was taken [rad]."""
        angle: float = self._taken[0]
        return angle

    def start_at(self, angle: float) -> None:
        """Stand still at `angle` [rad]: enabling must not jump."""
        for name in ("p0", "p1", "p2", "p3", "start", "reached"):
            self._course[name] = angle
        self._course["passed"] = self._course["total"] = 0

    def follow(self, setpoint: float, kind: Interpolation, interval: int, offsets: tuple[float, float] = (0.0, 0.0)) -> None:
        """In the coming cycle: the set-point [rad] as it stands, and offsets of velocity [rad/s] and torque [N·m].

        `interval`: servo periods from a set-point to the next.
        """
        self._setpoint[0] = setpoint
        self._faster[0], self._torque[0] = offsets
        self._interval[0] = interval
        self._kind[0] = kind
