"""Every axis truly moves where the task says, in the ordered sequence, and stops there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit
from drivetwin.hil_tests.targets import check_targets, targets
from drivetwin.hil_tests.task import Task


@dataclass(frozen=True)
class FinalPosition(Expectation):
    """For each target of a task `move` or `path`, after the one before it: the true position stands within `band` [m or rad] of
    it for `dwell` [s]."""

    name: ClassVar[str] = "final_position"
    needs_truth: ClassVar[bool] = True

    band: ByAxis = field(metadata=limit("settling_band"))
    dwell: float = 0.05

    def check(self, bench: Bench, task: Task, starts: int) -> None:
        check_targets(task, bench)

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding, reached = evidence.truth, MET, 0
        for pose in targets(evidence.task):
            target = {axis: position for axis, position in pose.items() if axis in self.band}
            if not target:
                continue
            there = np.ones(len(truth.time), dtype=np.bool_)
            there[:reached] = False
            for axis, position in target.items():
                number = evidence.axes.index(axis)
                there &= np.abs(truth.position[:, number] - position) <= self.band[axis]
            arrived = self._arrived(there, truth.time)
            if arrived is None:
                where = ", ".join(f"{axis} {position:g} {self._unit(evidence, axis)}" for axis, position in target.items())
                axis, nearest = self._nearest(evidence, target, reached)
                finding += self.fails(
                    f"the machine never stood at {where}, as the task says, after what came before it",
                    axis,
                    evidence.end,
                    nearest,
                    self.band[axis],
                    self._unit(evidence, axis),
                )
                continue
            reached = arrived
        return finding

    def _arrived(self, there: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], time: np.ndarray[Any, Any]) -> int | None:
        """The sample at which it has stood for long enough."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
        for start, end in zip(edges[::2], edges[1::2] - 1, strict=True):
            if time[end] - time[start] >= self.dwell:
                return int(np.searchsorted(time, time[start] + self.dwell))
        return None

    def _nearest(self, evidence: Evidence, target: dict[str, float], reached: int) -> tuple[str, float]:
        """The axis that was furthest off, at its nearest, and by how much."""
        position = evidence.truth.position[reached:]
        if not len(position):
            return next(iter(target)), np.inf
        off = {axis: float(np.abs(position[:, evidence.axes.index(axis)] - at).min()) for axis, at in target.items()}
        axis = max(off, key=lambda name: off[name] / self.band[name])
        return axis, off[axis]

    @staticmethod
    def _unit(evidence: Evidence, axis: str) -> str:
        return evidence.units[evidence.axes.index(axis)]
