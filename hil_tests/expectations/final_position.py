"""Every axis truly moves where the task says, in the ordered sequence, and stops there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from drivetwin.foundation.quantities import quantity
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import Evidence, Samples
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
            there = np.arange(len(truth.time)) >= reached
            for axis, off in self._off(evidence, target).items():
                there &= off <= self.band[axis]
            arrived = self._arrived(there, truth.time)
            if arrived is None:
                finding += self._never_stood(evidence, target, reached)
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

    def _never_stood(self, evidence: Evidence, target: dict[str, float], reached: int) -> Finding:
        """With the axis that was furthest off, and by how much, where all together stood nearest for long enough."""
        where = ", ".join(f"{axis} {position:g} {self._unit(evidence, axis)}" for axis, position in target.items())
        said = (
            f"the machine never stood at {where} for {quantity(self.dwell, 's')}, as the task says, after what came before it"
        )
        stay = self._nearest(evidence, target, reached)
        if stay is None:
            return self.fails(said, next(iter(target)), evidence.end)
        off = {axis: float(each[stay].max()) for axis, each in self._off(evidence, target).items()}
        axis = max(off, key=lambda name: off[name] / self.band[name])
        return self.fails(said, axis, evidence.end, off[axis], self.band[axis], self._unit(evidence, axis))

    def _nearest(self, evidence: Evidence, target: dict[str, float], reached: int) -> slice | None:
        """Samples over `dwell` in which all axes are in the smallest multiple of their bands; None: there are not so many."""
        time = evidence.truth.time
        used = np.max([off / self.band[axis] for axis, off in self._off(evidence, target).items()], axis=0)
        last = np.searchsorted(time, time + self.dwell)
        inside = np.minimum(last, len(time) - 1)
        last += time[inside] - time < self.dwell  # by rounding, else a sample too few
        first = np.arange(len(time))[(last < len(time)) & (np.arange(len(time)) >= reached)]
        if not len(first):
            return None
        spans = np.column_stack([first, last[first] + 1]).ravel()
        nearest = int(np.argmin(np.maximum.reduceat(np.append(used, np.inf), spans)[::2]))
        return slice(int(first[nearest]), int(last[first[nearest]]) + 1)

    @staticmethod
    def _off(evidence: Evidence, target: dict[str, float]) -> dict[str, Samples]:
        """How far each axis is from its target, over time."""
        position = evidence.truth.position
        return {axis: np.abs(position[:, evidence.axes.index(axis)] - at) for axis, at in target.items()}

    @staticmethod
    def _unit(evidence: Evidence, axis: str) -> str:
        return evidence.units[evidence.axes.index(axis)]
