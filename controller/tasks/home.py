"""home: every axis finds its zero, then moves to the nearer end of its travel."""

from __future__ import annotations

from drivetwin.controller.tasks.base import Task, Work

STAND = 0.1
"""For how long the axes stand afterwards [s]."""


class Home(Task):
    """No parameters."""

    def run(self, work: Work) -> None:
        work.do(lambda: work.session.wait(STAND))
