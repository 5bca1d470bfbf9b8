"""`--live`: a command shows how far it is, and its page once there is one, in a front panel; the page stays until Ctrl-C."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from drivetwin.cli.ended import ended_by_signals
from drivetwin.cli.panel_beside import panel_beside
from drivetwin.foundation.files import write_json
from drivetwin.foundation.scratch import scratch
from drivetwin.panel.run import FILE, MOST_LINES, Phase, Run

OFTEN = 0.2
"""Between two times that it is written how far a phase is, at least [s]."""

MOST_PHASES = 12
"""The last ones."""

AsLive = Annotated[
    bool,
    typer.Option("--live", help="Show progress and the report in a panel in the browser; the page stays until Ctrl-C."),
]


class Live:
    """What a command tells of itself; this one tells nobody."""

    def phase(self, name: str) -> None:
        """Another phase begins, and the one before is done."""

    def advance(self, share: float) -> None:
        """So much of the phase is done, 0..1."""

    def whole(self, share: float) -> None:
        """So much of all is done, 0..1."""

    def say(self, line: str) -> None:
        """A line for whoever looks."""

    def done(self, outcome: str, page: Path) -> None:
        """It has ended so, and its report is there. The panel stays until Ctrl-C."""


SILENT = Live()


class _InPanel(Live):
    """Writes run/1 for a panel."""

    def __init__(self, command: str, file: Path) -> None:
        self._file = file
        self._command = command
        self._whole: float | None = None
        self._phases: list[Phase] = []
        self._lines: list[str] = []
        self._written = 0.0
        self._write()

    def phase(self, name: str) -> None:
        self._end_phase()
        self._phases = [*self._phases, Phase(name=name, share=0.0)][-MOST_PHASES:]
        self._write()

    def advance(self, share: float) -> None:
        if self._phases:
            self._phases[-1] = Phase(name=self._phases[-1].name, share=min(1.0, share))
        self._write_now_and_then()

    def whole(self, share: float) -> None:
        self._whole = min(1.0, share)
        self._write_now_and_then()

    def say(self, line: str) -> None:
        self._lines = [*self._lines, line][-MOST_LINES:]
        self._write()

    def done(self, outcome: str, page: Path) -> None:
        self._end_phase()
        self._whole = None if self._whole is None else 1.0
        self._write(outcome, str(page.resolve()))
        ended = ended_by_signals()
        print("drivetwin: done; the page stays until Ctrl-C", file=sys.stderr, flush=True)
        ended.wait()

    def _end_phase(self) -> None:
        if self._phases:
            self._phases[-1] = Phase(name=self._phases[-1].name, share=1.0)

    def _write_now_and_then(self) -> None:
        if time.monotonic() - self._written >= OFTEN:
            self._write()

    def _write(self, outcome: str = "", page: str | None = None) -> None:
        self._written = time.monotonic()
        run = Run(command=self._command, share=self._whole, phases=self._phases, lines=self._lines, outcome=outcome, page=page)
        write_json(self._file, run.model_dump())


@contextmanager
def live(asked: bool, command: str, bus: Sequence[str] = ()) -> Iterator[Live]:
    """While the block runs, and after it until Ctrl-C where it is `done`. `bus`: arguments of a panel that shows a bus too."""
    if not asked:
        yield SILENT
        return
    with scratch() as folder:
        told = _InPanel(command, folder / FILE)
        with panel_beside(["--run", str(folder), *bus]):
            yield told
