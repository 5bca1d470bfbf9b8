"""path: all axes together from pose to pose."""

from __future__ import annotations

from functools import partial

from pydantic import Field, FiniteFloat, NonNegativeFloat, PositiveInt

from drivetwin.controller.machine import Machine
from drivetwin.controller.session import Session
from drivetwin.controller.tasks.base import Task, Work, check_target


class Path(Task):
    """`poses` in their order, each a position of some axes [m or rad], `repeat` times, with `dwell` [s] after each."""

    poses: tuple[dict[str, FiniteFloat], ...] = Field(min_length=1)
    repeat: PositiveInt = 1
    dwell: NonNegativeFloat = 0.3

    def check(self, machine: Machine) -> None:
        for pose in self.poses:
            for axis, position in pose.items():
                check_target(machine, axis, position)

    def run(self, work: Work) -> None:
        for _ in range(self.repeat):
            for pose in self.poses:
                work.do(partial(self._go, work.session, pose))

    def _go(self, session: Session, pose: dict[str, float]) -> None:
        session.travel(pose)
        session.wait(self.dwell)
