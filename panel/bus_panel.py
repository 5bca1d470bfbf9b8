"""A bus with its drives as the server shows it, and beside it the command that runs on it, where one tells of itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from drivetwin.foundation.errors import UserError
from drivetwin.panel.access import Pen
from drivetwin.panel.asks import read_ask
from drivetwin.panel.panel import Panel
from drivetwin.panel.parameter_desk import dcf_name, saved
from drivetwin.panel.run import RunWatch
from drivetwin.panel.scope.save import csv_of, recording_of, zipped
from drivetwin.panel.shown import Asked, Told
from drivetwin.panel.views import VIEWS


class BusPanel:
    """All views of a bus; that of `run` first."""

    def __init__(self, panel: Panel, run: RunWatch | None) -> None:
        self._panel = panel
        self._run = run
        self.views: Mapping[str, Callable[[], Told]] = {
            **({} if run is None else {"run": run.told}),
            **{name: partial(view, panel) for name, view in VIEWS.items()},
        }

    @property
    def pen(self) -> Pen:
        """The panel's."""
        return self._panel.pen

    def head(self) -> Told:
        """Which bus, and what moves the machine."""
        link, motion = self._panel.link, self._panel.motion
        return {"bus": link.name, "lost": link.lost, "motion": None if motion is None else motion.told()}

    def asked(self, question: dict[str, Any]) -> Asked:
        """Raises UserError for what is no question."""
        ask = read_ask(question)
        return Asked(ask.writes, partial(ask.answer, self._panel), ask.of_a_drive)

    def files(self) -> list[Route]:
        """What the scope holds, the parameters of a drive, the pages of the run."""
        return [
            Route("/parameters/{node:int}.dcf", self._parameters),
            Route("/scope.csv", self._scope_csv),
            Route("/scope.zip", self._scope_recording),
            *([] if self._run is None else self._run.files()),
        ]

    def _parameters(self, request: Request) -> Response:
        number = request.path_params["node"]
        name = dcf_name(self._panel.nodes[number]) if number in self._panel.nodes else ""
        return _file(name, "text/plain", lambda: saved(self._panel.node(number)).encode())

    def _scope_csv(self, _: Request) -> Response:
        scope = self._panel.scope
        return _file("scope.csv", "text/csv", lambda: csv_of(scope.settings.channels, scope.shown()).encode())

    def _scope_recording(self, _: Request) -> Response:
        scope = self._panel.scope

        def made() -> bytes:
            return zipped(recording_of(scope.settings.channels, scope.shown(), self._panel.machine))

        return _file("scope.zip", "application/zip", made)


def _file(name: str, kind: str, made: Callable[[], bytes]) -> Response:
    """A file to keep, or why there is none."""
    try:
        content = made()
    except UserError as error:
        return PlainTextResponse(f"{error}\n", 409)
    return Response(content, media_type=kind, headers={"content-disposition": f'attachment; filename="{name}"'})
