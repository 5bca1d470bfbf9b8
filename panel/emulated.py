"""The machine that the panel starts where it is told of no bus: `drivetwin emulate`, as a process of its own.

SYNC moves its time, of the motion or else of the panel, so that a busy computer makes it slower and does not disturb it.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from drivetwin.foundation.children import end_with_parent
from drivetwin.foundation.errors import UserError

PATIENCE = 10.0
"""Longest that an emulator may take to end [s]."""


class Emulated:
    """`drivetwin emulate` on a bus, by default one of its own in `folder`, with its control socket there."""

    def __init__(self, machine: str, profile: str, bus: str | None, folder: Path, more: Sequence[str] = ()) -> None:
        """`more`: further arguments. Raises UserError with what the emulator says where it does not start."""
        self.control = folder / "control"
        command = [sys.executable, "-m", "drivetwin", "emulate", "--json", "--clock", "sync"]
        self._process = subprocess.Popen(
            [
                *command,
                "--machine",
                machine,
                "--profile",
                profile,
                "--bus",
                bus or f"unix:{folder / 'bus'}",
                "--control",
                str(self.control),
                *more,
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C is the panel's, which then ends the emulator
            preexec_fn=partial(end_with_parent, os.getpid(), signal.SIGTERM),  # noqa: PLW1509
        )
        try:
            told = self._first_line()
        except BaseException:  # Ctrl-C, or whoever waits gives up
            self.stop()
            raise
        self.bus: str = told["on"][0]
        self.nodes: dict[str, int] = told["nodes"]

    def _first_line(self) -> dict[str, Any]:
        """What it says once it is on its bus. Raises UserError where it ends before."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            _, said = self._process.communicate(timeout=PATIENCE)
            raise UserError(said.strip().removeprefix("drivetwin: ") or "the emulator did not start")
        told: dict[str, Any] = json.loads(line)
        return told

    def stop(self) -> None:
        """End it, and wait until it has gone."""
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
