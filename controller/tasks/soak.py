"""soak: all axes back and forth together, for a long time."""

from __future__ import annotations

from functools import partial
from itertools import cycle

from pydantic import PositiveFloat

from drivetwin.controller.tasks.base import Task, Work

REACH = 0.3
"""How far an axis goes to either side of the middle of its travel, as a share of the travel."""


class Soak(Task):
    """`seconds` of motion, from the first move to at least the end of the one that is under way then."""

    seconds: PositiveFloat = 60.0

    def run(self, work: Work) -> None:
        session = work.session
        work.do(partial(session.travel, session.machine.beside_the_middle(-REACH)))
        last = session.cycle.count + round(self.seconds / session.cycle.period)
        for side in cycle((REACH, -REACH)):
            if session.cycle.count >= last:
                return
            work.do(partial(session.travel, session.machine.beside_the_middle(side)))
