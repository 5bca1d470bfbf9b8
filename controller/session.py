"""Drives that are enabled and stream: move them, capture what they do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.capture import position_demand, record
from controller.cycle import Cycle
from controller.drive_node import DriveNode
from controller.excitation import with_held
from controller.machine import Machine
from controller.motion import Offsets, positions_now, stream
from controller.progress import Progress
from controller.trajectory import move, side_by_side
from drivetwin.recording.recording import AxisInfo, Recording


@dataclass
class Session:
    """Drives that are enabled and stream."""

    cycle: Cycle
    drives: Sequence[DriveNode]
    machine: Machine
    axes: dict[str, AxisInfo]
    progress: Progress

    def go_to(self, targets: dict[str, float]) -> None:
        """Move the named axes [m or rad]; the others hold."""
        start = positions_now(self.drives)
        paths = []
        for drive, position in zip(self.drives, start, strict=True):
            target = targets.get(drive.name, float(position))
            axis = drive.axis
            paths.append(move(float(position), target, axis.max_speed, 0.5 * axis.max_acceleration, self.cycle.period))
        stream(self.cycle, self.drives, side_by_side(paths))
        self.cycle.run_for(0.1)

    def capture(self, name: str, paths: dict[str, NDArray[np.float64]]) -> Recording:
        """Stream the paths of the named axes, the others holding, and record every axis."""
        held = dict(zip(self.axes, (float(value) for value in positions_now(self.drives)), strict=True))
        return self.run(name, with_held(paths, held))

    def run(self, name: str, demand: NDArray[np.float64], offsets: Offsets | None = None) -> Recording:
        """Stream positions (n, axes) [m or rad] with their offsets and record every axis."""
        self.progress.phase(name.replace("_", " "), len(demand) * self.cycle.period)
        start = positions_now(self.drives)
        samples = stream(self.cycle, self.drives, demand, offsets, self._advance)
        shown = position_demand(self.drives, start, demand)
        return record(name, self.machine.machine, self.cycle.period, self.axes, shown, samples)

    def _advance(self, cycles: int) -> None:
        self.progress.advance(cycles * self.cycle.period)
