"""The motion that the panel starts on a machine that it has emulated: the reference controller, as a program of its own."""

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


class Motion:
    """All axes to and fro, by `python -m drivetwin.controller`, on a bus; `folder` takes its files."""

    def __init__(self, bus: str, machine: str, profile: str, folder: Path) -> None:
        self._folder = folder
        self._task = folder / "motion.json"
        told = {"format": "task/1", "task": "soak", "machine": machine, "profile": profile, "cycle": CYCLE}
        self._task.write_text(json.dumps({**told, "parameters": {"seconds": FOR_LONG}}), encoding="utf-8")
        self._command = [sys.executable, "-m", "drivetwin.controller", str(self._task), "--bus", bus]
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def runs(self) -> bool:
        """Whether the controller is there."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Home the axes and move them. Raises UserError where they move already."""
        if self.runs:
            raise UserError("the motion runs already")
        out = self._folder / "out"
        (out / "controller.json").unlink(missing_ok=True)
        with (self._folder / "motion.log").open("wb") as log:
            self._process = subprocess.Popen(
                [*self._command, "--clock", "paced", "--out", str(out)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=log,
                start_new_session=True,  # Ctrl-C is the panel's, which then ends the motion
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

    def told(self) -> dict[str, object]:
        """For the page: whether it runs, else what the controller said when it ended."""
        return {"runs": self.runs, "said": "" if self.runs else self._said()}

    def _said(self) -> str:
        try:
            outcome = json.loads((self._folder / "out" / "controller.json").read_text(encoding="utf-8"))
            return f"{outcome['outcome']}: {outcome['reason']}" if outcome["reason"] else str(outcome["outcome"])
        except (OSError, ValueError):
            return (self._folder / "motion.log").read_text(encoding="utf-8", errors="replace").strip()[-500:]
