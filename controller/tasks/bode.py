"""bode: frequency response, step response and torque-speed curve of axes, as bode.json (method: `drivetwin bode`)."""

from __future__ import annotations

from drivetwin.controller.commissioning import Attempt, attempt_each
from drivetwin.controller.commissioning_file import responses_to_json
from drivetwin.controller.machine import Machine
from drivetwin.controller.tasks.base import Task, Work
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import write_json


class Bode(Task):
    """`axes` one after the other, all where none is named; the file grows with each."""

    axes: tuple[str, ...] = ()

    def check(self, machine: Machine) -> None:
        machine.check_axes(self.axes)

    def run(self, work: Work) -> None:
        session, attempts = work.session, list[Attempt]()
        work.do(session.to_rest)
        for attempt in attempt_each(session, self.axes or tuple(session.machine.axes), work.seed):
            attempts.append(attempt)
            write_json(work.out / "bode.json", responses_to_json(attempts, session, work.seed))
        if failures := [attempt.failure for attempt in attempts if attempt.failure]:
            raise UserError("; ".join(failures))
