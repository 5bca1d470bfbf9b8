"""The commissioning desk: one axis measured by the reference controller's task `bode`, and the last that it has found."""

from __future__ import annotations

import json
import time
from typing import Any

from drivetwin.foundation.errors import UserError
from drivetwin.panel.motion import Motion, Program


class Commissioning:
    """Measures axes of the machine that the panel has emulated; `program` does it, in the place of `motion`."""

    def __init__(self, program: Program, motion: Motion, axes: tuple[str, ...]) -> None:
        self.axes = axes
        self._program = program
        self._motion = motion
        self._axis = ""
        self._began = 0.0
        self._found: dict[str, Any] = {}

    @property
    def runs(self) -> bool:
        """Whether an axis is being measured."""
        return self._program.runs

    def start(self, axis: str) -> None:
        """Stop the motion and measure `axis`. Raises UserError for an axis that there is not, or while one is measured."""
        if axis not in self.axes:
            raise UserError(f"there is no axis {axis!r}; there are {', '.join(self.axes)}")
        if self.runs:
            raise UserError(f"axis {self._axis} is being measured; stop that first")
        self._motion.stop()
        self._axis, self._began = axis, time.monotonic()
        self._program.start({"axes": [axis]})

    def stop(self) -> None:
        """Let the controller stop every axis and leave."""
        self._program.stop()

    def told(self) -> dict[str, object]:
        """For the page: which axis is measured and for how long [s], what went wrong, what was found of each axis."""
        if self._axis and not self.runs:
            self._take()
        return {
            "axes": self.axes,
            "axis": self._axis,
            "runs": self.runs,
            "since": round(time.monotonic() - self._began) if self.runs else 0,
            "said": self._program.said() if self._axis and not self.runs else "",
            "found": self._found,
        }

    def _take(self) -> None:
        """What the controller has written is taken over once, and its file is then gone."""
        file = self._program.out / "bode.json"
        if file.is_file():
            self._found |= json.loads(file.read_text(encoding="utf-8"))["axes"]
            file.unlink()
