"""A panel without a bus: it shows a run, and nothing can be asked of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from starlette.routing import Route

from drivetwin.foundation.errors import UserError
from drivetwin.panel.access import Pen
from drivetwin.panel.run import RunWatch
from drivetwin.panel.shown import Asked, Told


class RunPanel:
    """A run as the server shows it."""

    def __init__(self, run: RunWatch) -> None:
        self._run = run
        self.pen = Pen(allowed=False)

    @property
    def views(self) -> Mapping[str, Callable[[], Told]]:
        """One."""
        return {"run": self._run.told}

    def head(self) -> Told:
        """No bus, no motion."""
        return {"bus": "", "lost": None, "motion": None}

    def asked(self, question: dict[str, Any]) -> Asked:
        """Raises UserError."""
        raise UserError(f"this panel has no bus and answers no {question.get('ask')!r}: it shows how far a command is")

    def files(self) -> list[Route]:
        """Of the run."""
        return self._run.files()
