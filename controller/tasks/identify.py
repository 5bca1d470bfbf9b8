"""identify: friction and inertia of every axis into identified.json, by the method of `drivetwin identify`."""

from __future__ import annotations

from drivetwin.controller.procedure import FIT, capture_friction
from drivetwin.controller.tasks.base import Task, Work
from drivetwin.foundation.files import write_json
from drivetwin.identification import identify, load_model


class Identify(Task):
    """No parameters."""

    def run(self, work: Work) -> None:
        session = work.session
        work.do(session.to_rest)
        captured = capture_friction(session, work.seed)
        machine = session.machine
        found = session.meanwhile(
            lambda: identify(load_model(machine.model_path), captured.recordings, captured.validation, FIT)
        )
        inputs = [machine.model_path, machine.axes_path]
        write_json(work.out / "identified.json", found.to_json(None, work.seed, inputs, work.out))
