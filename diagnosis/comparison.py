"""The samples on which causes are compared: rows of all recordings, axis by axis, dealt into folds of contiguous blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import islice, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.measured import AxisRun, Run
from diagnosis.side_by_side import side_by_side
from diagnosis.simulation import Kinematics, Simulation
from drivetwin.motion.inverse_dynamics import Model
from emulator.dynamics import AxisDynamics
from emulator.effects import AxisEffect, Effect, Start

Array = NDArray[np.float64]
Column = Mapping[str, Array]
"""Torque on the compared rows of each axis that it acts on."""

FOLDS = 5
BLOCK = 2.0
"""Of contiguous time that goes into a fold together [s]: longer than what a filter or an axis remembers."""
SAME_AXIS = 1e-3
"""Of each of its numbers, by which an axis may differ for a search to begin at the same place."""
LONG = 72.0
"""Of recordings together, beyond which a search begins on a sample of them [s]."""
ENOUGH, PIECE, LEAST_PIECE = 36.0, 12.0, 8.0
"""Of a sample together, about, of its pieces, and of the one of a recording that is owed less [s]."""
MUCH_SHORTER = 0.7
"""Of the whole, the longest that a sample is worth while."""
FAIR = 0.5
"""Of an axis's share of the rows, the least that a sample must have: axes may have moved one after the other."""


@dataclass(frozen=True)
class Tried:
    """Where a search begins, and what each of its members costs on the compared rows, (N,) each."""

    start: Start
    columns: tuple[Array, ...]


@dataclass(frozen=True)
class Comparison:
    """Prepared recordings, seen as rows: those samples of each axis that are fitted, thinned to what the filter leaves."""

    simulation: Simulation
    runs: Sequence[Run]
    relative: frozenset[str] = frozenset()
    """Axes whose position is known from where a recording began, not absolutely."""
    _starts: dict[tuple[str, str], list[tuple[AxisDynamics, list[Tried]]]] = field(default_factory=dict)
    nominals: list[Any] = field(default_factory=list)
    """Parameters of the model and what they cost, once they were asked for (nominal.py)."""
    drives: dict[str, Any] = field(default_factory=dict)
    """Effects of each axis's drive, once they were asked for (drive_search.py): they do not depend on what is selected."""
    polynomials: dict[tuple[str, str], Any] = field(default_factory=dict)
    """Of effects on the rigid bodies, by axis and effect, once they were asked for (model_search.py)."""

    @cached_property
    def _picks(self) -> dict[str, list[NDArray[np.intp]]]:
        """Sample numbers of the rows, by axis and run."""
        return {
            axis: [
                np.flatnonzero(run.axes[axis].fitted[:: run.stride]) * run.stride
                for run in self.runs
            ]
            for axis in self.simulation.axes
        }

    @cached_property
    def _order(self) -> dict[str, NDArray[np.intp]]:
        return {axis: np.argsort(self._fold_of(axis), kind="stable") for axis in self.simulation.axes}

    @cached_property
    def folds(self) -> dict[str, list[slice]]:
        """The rows of each fold, by axis."""
        found = {}
        for axis in self.simulation.axes:
            bounds = np.searchsorted(np.sort(self._fold_of(axis)), np.arange(FOLDS + 1))
            found[axis] = [slice(int(a), int(b)) for a, b in pairwise(bounds)]
        return found

    def _fold_of(self, axis: str) -> NDArray[np.intp]:
        blocks, passed = [], 0
        for run, picks in zip(self.runs, self._picks[axis], strict=True):
            blocks.append(passed + (picks * run.period / BLOCK).astype(np.intp))
            passed += int(len(run.recording.time) * run.period / BLOCK) + 1
        return np.concatenate(blocks) % FOLDS

    def as_rows(self, axis: str, in_time: Array) -> Array:
        """The reverse of `in_time`, of all recordings together."""
        return np.asarray(in_time[self._order[axis]])

    def durations(self, axis: str) -> Array:
        """Time that each row stands for [s], (N,)."""
        parts = [np.full(len(picks), run.period * run.stride) for run, picks in zip(self.runs, self._picks[axis], strict=True)]
        return self.as_rows(axis, np.concatenate(parts))

    def in_time(self, axis: str, rows: Array) -> list[Array]:
        """Rows (N,) back in the order of time, an array a recording."""
        back = np.empty_like(rows)
        back[self._order[axis]] = rows
        return np.split(back, np.cumsum([len(picks) for picks in self._picks[axis]])[:-1])

    def rows(self, axis: str, of_run: Callable[[Run, AxisRun], Array]) -> Array:
        """What `of_run` gives for every sample (n,) of each recording and the axis in it, on the rows of the axis (N,)."""
        return self.picked(axis, [of_run(run, run.axes[axis]) for run in self.runs])

    def picked(self, axis: str, samples: Sequence[Array]) -> Array:
        """Every sample (n,) of each recording, on the rows of the axis (N,)."""
        parts = [values[picks] for values, picks in zip(samples, self._picks[axis], strict=True)]
        return np.asarray(np.concatenate(parts)[self._order[axis]])

    def rigid_rows(self, of_motion: Callable[[Kinematics], Array]) -> dict[str, Array]:
        """Torque (n, k) that a rigid model needs for a motion of all axes, on the rows of each axis."""
        thinned = [of_motion(run.kinematics.every(run.stride)) for run in self.runs]
        found = {}
        for k, axis in enumerate(self.simulation.axes):
            parts = [
                torque[picks // run.stride, k]
                for torque, run, picks in zip(thinned, self.runs, self._picks[axis], strict=True)
            ]
            found[axis] = np.asarray(np.concatenate(parts)[self._order[axis]])
        return found

    def predicted(self, axis: str, effect: AxisEffect, dynamics: AxisDynamics) -> Array:
        """Torque (N,) that an effect costs on its axis."""
        return self.rows(axis, lambda run, own: run.felt(own, effect.predict(own.motion, dynamics)))

    def cost(self, axis: str, effect: AxisEffect, dynamics: AxisDynamics) -> dict[str, Array]:
        """Torque that an effect costs on its axis, and on those that feel its joint move otherwise than measured."""
        costs = [run.cost(axis, effect, dynamics) for run in self.runs]
        felt = dict.fromkeys(name for cost in costs for name in cost)
        none = [np.zeros(len(run.recording.time)) for run in self.runs]
        return {on: self.picked(on, [cost.get(on, zero) for cost, zero in zip(costs, none, strict=True)]) for on in felt}

    def starts(self, axis: str, kind: type[AxisEffect], dynamics: AxisDynamics) -> list[Tried]:
        """Where a search for an effect begins, with what its members cost.

        Kept, for every step of a diagnosis asks again, on axes that are as they were or have hardly been corrected since.
        """
        kept = self._starts.setdefault((axis, kind.name), [])
        known = next((tried for before, tried in kept if before.is_nearly(dynamics, SAME_AXIS)), None)
        if known is None:
            known = self._tried(axis, kind, dynamics)
            kept.append((dynamics, known))
        return known

    def _tried(self, axis: str, kind: type[AxisEffect], dynamics: AxisDynamics) -> list[Tried]:
        longest = max(self.runs, key=lambda run: len(run.recording.time))
        found = kind.starts(longest.axes[axis].motion, dynamics)
        members = [member for start in found for member in start.members]
        columns = iter(side_by_side(lambda member: self.predicted(axis, member, dynamics), members))
        return [Tried(start, tuple(islice(columns, len(start.members)))) for start in found]

    def predicted_by_model(self, axis: str, effect: Effect) -> dict[str, Array]:
        """Torque that an effect on the rigid bodies costs, on every axis."""
        return self._beyond_rigid(self.simulation.rigid_with(axis, effect))

    def predicted_by_heavier(self, body: int) -> dict[str, Array]:
        """Torque that twice the mass and inertia of one body, by its number, costs besides, on every axis."""
        return self._beyond_rigid(self.simulation.rigid_with_heavier(body))

    def _beyond_rigid(self, changed: Model) -> dict[str, Array]:
        whole = self.rigid_rows(partial(self.simulation.torques_of, changed))
        return {name: (rows - self._rigid[name]) * self._moves[name] for name, rows in whole.items()}

    @cached_property
    def _moves(self) -> dict[str, Array]:
        """Share of what a filtered row is made of in which its axis does not stick."""
        return {axis: self.rows(axis, lambda run, own: run.moves(own)) for axis in self.simulation.axes}

    @cached_property
    def _rigid(self) -> dict[str, Array]:
        return self.rigid_rows(self.simulation.torques)

    @cached_property
    def target(self) -> dict[str, Array]:
        """Measured torque less that of the simulation as it stands, by axis."""
        return {axis: self.rows(axis, lambda _, own: own.torque - own.base) for axis in self.simulation.axes}

    @cached_property
    def measured(self) -> dict[str, Array]:
        """Measured torque, by axis."""
        return {axis: self.rows(axis, lambda _, own: own.torque) for axis in self.simulation.axes}

    @cached_property
    def sample(self) -> Comparison:
        """Some of it, where it is long: pieces spread over all recordings, enough to begin a search on."""
        if self.duration <= LONG:
            return self
        pieces = [piece for run in self.runs for piece in _pieces(run, self.duration)]
        sample = Comparison(self.simulation, pieces, self.relative)
        share = sample.duration / self.duration
        fair = all(sample.count(axis) >= FAIR * share * self.count(axis) for axis in self.simulation.axes)
        return sample if share <= MUCH_SHORTER and fair else self

    @property
    def duration(self) -> float:
        """Of all recordings together [s]."""
        return sum(len(run.recording.time) * run.period for run in self.runs)

    def count(self, axis: str) -> int:
        """How many rows an axis has."""
        return sum(len(picks) for picks in self._picks[axis])

    @property
    def span(self) -> float:
        """From the first sample of all recordings to the last [s]."""
        times = [run.recording.time for run in self.runs]
        return float(max(time[-1] for time in times) - min(time[0] for time in times))


def _pieces(run: Run, whole: float) -> list[Run]:
    """Pieces of a recording that are its share of a sample: from its beginning to its end, or one from its middle."""
    own = len(run.recording.time)
    owed = ENOUGH * own * run.period / whole
    count = max(1, round(owed / PIECE))
    length = round((PIECE if owed > LEAST_PIECE else LEAST_PIECE) / run.period)
    if length >= own:
        return [run]
    begins = np.linspace(0, own - length, count).astype(int) if count > 1 else [(own - length) // 2]
    return [run.piece(slice(int(begin), int(begin) + length)) for begin in begins]
