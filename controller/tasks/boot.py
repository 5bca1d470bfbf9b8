"""boot: every drive configured and operational; nothing is enabled, nothing moves."""

from __future__ import annotations

from drivetwin.controller.tasks.base import Task, Work

LISTEN = 0.5
"""How long the nodes are supervised [s]: some heartbeats."""


class Boot(Task):
    """No parameters."""

    def run(self, work: Work) -> None:
        work.session.wait(LISTEN)
