"""bode: frequency response, step response and torque-speed curve of axes, as bode.json (method: `drivetwin bode`)."""

from __future__ import annotations

from drivetwin.controller.commissioning import commission
from drivetwin.controller.commissioning_file import responses_to_json
from drivetwin.controller.machine import Machine
from drivetwin.controller.tasks.base import Task, Work
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import write_json
from drivetwin.identification.frequency.result import AxisResponse


class Bode(Task):
    """`axes` one after the other, all where none is named; the file grows with each."""

    axes: tuple[str, ...] = ()

    def check(self, machine: Machine) -> None:
        if strange := [axis for axis in self.axes if axis not in machine.axes]:
            raise UserError(f"machine {machine.machine} has no axis {strange[0]!r}, only {', '.join(machine.axes)}")

    def run(self, work: Work) -> None:
        session, found = work.session, list[AxisResponse]()
        work.do(session.to_rest)
        for axis in self.axes or session.machine.axes:
            measured = commission(session, axis, work.seed)
            found.append(session.meanwhile(measured.evaluate))
            write_json(work.out / "bode.json", responses_to_json(found, session, work.seed))
