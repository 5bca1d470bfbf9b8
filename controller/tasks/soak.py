"""soak: all axes back and forth together, for a long time."""

from __future__ import annotations

from functools import partial
from itertools import cycle

from pydantic import PositiveFloat

from drivetwin.controller.machine import Machine
from drivetwin.controller.tasks.base import Task, Work

REACH = 0.3
"""How far an axis goes to either side of the middle of its travel, as a share of the travel."""


class Soak(Task):
    """`seconds` of motion, from the first move to at least the end of the one that is under way then."""

    seconds: PositiveFloat = 60.0

    def run(self, work: Work) -> None:
        session = work.session
        work.do(partial(session.travel, _pose(session.machine, -REACH)))
        last = session.cycle.count + round(self.seconds / session.cycle.period)
        for side in cycle((REACH, -REACH)):
            if session.cycle.count >= last:
                return
            work.do(partial(session.travel, _pose(session.machine, side)))


def _pose(machine: Machine, share: float) -> dict[str, float]:
    """Every axis at a share of its travel beside the middle [m or rad]."""
    return {name: sum(axis.travel) / 2.0 + share * (axis.travel[1] - axis.travel[0]) for name, axis in machine.axes.items()}
