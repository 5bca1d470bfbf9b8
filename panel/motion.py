"""What the panel lets the reference controller do on a machine that it has emulated: a program with one task."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

from drivetwin.foundation.children import end_with_parent
from drivetwin.foundation.errors import UserError

CYCLE = 0.004
"""Communication cycle [s]: leaves a small computer time for the page."""

FOR_LONG = 1e6
"""Seconds of motion: until somebody ends it."""

PATIENCE = 30.0
"""Longest that a controller may take to stop its axes [s]."""


class Program:
    """`python -m drivetwin.controller` with one task on a bus; its files are in `folder`/`task`."""

    def __init__(self, bus: str, machine: str, profile: str, folder: Path, task: str, cycle: float, clock: str) -> None:
        self._folder = folder / task
        self._folder.mkdir()
        self.out = self._folder / "out"
        self._told = {"format": "task/1", "task": task, "machine": machine, "profile": profile, "cycle": cycle}
        file = str(self._folder / "task.json")
        self._command = [
            sys.executable,
            "-m",
            "drivetwin.controller",
            file,
            "--bus",
            bus,
            "--clock",
            clock,
            "--out",
            str(self.out),
        ]
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def runs(self) -> bool:
        """Whether the controller is there."""
        return self._process is not None and self._process.poll() is None

    def start(self, parameters: dict[str, object]) -> None:
        """Do the task with these parameters. Raises UserError where it is being done."""
        if self.runs:
            raise UserError(f"{self._told['task']} runs already")
        (self._folder / "task.json").write_text(json.dumps({**self._told, "parameters": parameters}), encoding="utf-8")
        (self.out / "controller.json").unlink(missing_ok=True)
        with (self._folder / "log").open("wb") as log:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=log,
                start_new_session=True,  # Ctrl-C is the panel's, which then ends the program
                preexec_fn=partial(end_with_parent, os.getpid(), signal.SIGTERM),  # noqa: PLW1509
            )

    def stop(self) -> None:
        """Let the controller stop every axis and leave; nothing happens where it has gone."""
        if self._process is None or not self.runs:
            return
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def said(self) -> str:
        """What the controller said when it ended."""
        try:
            outcome = json.loads((self.out / "controller.json").read_text(encoding="utf-8"))
            return f"{outcome['outcome']}: {outcome['reason']}" if outcome["reason"] else str(outcome["outcome"])
        except (OSError, ValueError):
            log = self._folder / "log"
            return log.read_text(encoding="utf-8", errors="replace").strip()[-500:] if log.is_file() else ""


class Motion:
    """All axes to and fro, until somebody ends it."""

    def __init__(self, bus: str, machine: str, profile: str, folder: Path) -> None:
        self._program = Program(bus, machine, profile, folder, "soak", CYCLE, "paced")

    @property
    def runs(self) -> bool:
        """Whether the controller is there."""
        return self._program.runs

    def start(self) -> None:
        """Home the axes and move them. Raises UserError where they move already."""
        if self.runs:
            raise UserError("the motion runs already")
        self._program.start({"seconds": FOR_LONG})

    def stop(self) -> None:
        """Let the controller stop every axis and leave; nothing happens where it has gone."""
        self._program.stop()

    def told(self) -> dict[str, object]:
        """For the page: whether it runs, else what the controller said when it ended."""
        return {"runs": self.runs, "said": "" if self.runs else self._program.said()}
