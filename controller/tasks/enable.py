"""enable: every axis enabled at its position, held, disabled; no homing."""

from __future__ import annotations

from pydantic import PositiveFloat

from drivetwin.controller.motion import enable_streaming
from drivetwin.controller.tasks.base import Task, Work


class Enable(Task):
    """`hold`: for how long [s]."""

    hold: PositiveFloat = 1.0

    def run(self, work: Work) -> None:
        enable_streaming(work.session.cycle, work.session.drives)
        work.session.wait(self.hold)
