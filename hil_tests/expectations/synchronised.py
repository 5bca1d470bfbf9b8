"""Axes that move together stay together: on the straight line between two poses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import Evidence, Samples
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding, limit
from drivetwin.hil_tests.moves import moves
from drivetwin.hil_tests.targets import check_targets, targets
from drivetwin.hil_tests.task import Task

LEAST_WAY = 1e-3
"""An axis that goes less [m or rad] has no share worth comparing."""

SAME = 1e-4
"""A demand is at a pose where no axis is further off [m or rad]."""


@dataclass(frozen=True)
class Synchronised(Expectation):
    """For each move to a pose of the task: how far each axis has come, as a share of its way, differs between axes by at most
    `apart`, by the plant's truth. Moves that overlap in time belong together; they have to begin and end together, too."""

    name: ClassVar[str] = "synchronised"
    needs_truth: ClassVar[bool] = True

    apart: float = field(metadata=limit("apart"))

    def check(self, bench: Bench, task: Task, starts: int) -> None:
        check_targets(task, bench)

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding, worst, when = evidence.truth, MET, 0.0, None
        together = 0
        for first, last, axes in _groups(evidence):
            if len(axes) < 2 or not _is_pose(evidence, last):
                continue
            together += 1
            shares = np.column_stack([_share(truth.position[:, axis], truth.demand[:, axis], first, last) for axis in axes])
            apart = shares.max(axis=1) - shares.min(axis=1)
            at = int(np.argmax(apart))
            if apart[at] > worst:
                worst, when = float(apart[at]), float(truth.time[first + at])
        if not together:
            return self.fails("no two axes moved together", None, evidence.end)
        message = "axes that move together are not together"
        return finding + self.at_most("axes apart, of the way", worst, self.apart, "1", message, None, when)


def _groups(evidence: Evidence) -> list[tuple[int, int, list[int]]]:
    """Samples from first to last in which some axes move, and the axes that do, in the order of time."""
    found = sorted(
        (move.first, move.last, number)
        for number in range(len(evidence.axes))
        for move in moves(evidence.truth, number)
        if abs(evidence.truth.demand[move.last, number] - evidence.truth.demand[move.first, number]) > LEAST_WAY
    )
    groups: list[tuple[int, int, list[int]]] = []
    for first, last, number in found:
        if groups and first < groups[-1][1]:
            begin, end, axes = groups[-1]
            groups[-1] = (begin, max(end, last), [*axes, number])
        else:
            groups.append((first, last, [number]))
    return groups


def _is_pose(evidence: Evidence, sample: int) -> bool:
    """Whether the demand is at a pose that the task names."""
    demand = dict(zip(evidence.axes, evidence.truth.demand[sample].tolist(), strict=True))
    return any(all(abs(demand[axis] - at) < SAME for axis, at in pose.items()) for pose in targets(evidence.task))


def _share(position: Samples, demand: Samples, first: int, last: int) -> Samples:
    """How far (n,) of the way the axis has come."""
    start, end = demand[first], demand[last]
    return np.asarray((position[first : last + 1] - start) / (end - start))
