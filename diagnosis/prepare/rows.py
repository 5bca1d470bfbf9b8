"""The samples on which causes are weighed: rows of each axis in the order of time, recording after recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.deflection import axis_of, centred, deflection_of, is_torque
from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.run import AxisRun, Run, sampled
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects import AxisEffect, Effect
from drivetwin.foundation.cached import cached_property
from drivetwin.motion.inverse_dynamics import Model

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Column = Mapping[str, Array]
"""Torque on the rows of each axis that it acts on, and its deflection where that is measured [rad or m]."""

ENOUGH = 30.0
"""Time of motion [s] on which a search begins where there is much more."""
SEARCHED = 50_000
"""Samples of all recordings together, thinned, on which a search decides what is there: two minutes at a cut-off of 48 Hz."""
PIECES, PIECE = 3, 10.0
"""Of each recording, in a small part of it, and how long one is that is not cut further [s]: where a piece begins, the state of
play and bristles is not known."""
MUCH = 1.5
"""Times as much, from which a part is worth while."""


@dataclass(frozen=True)
class AxisRows:
    """Rows of one axis, (N,) each: their recording, their sample number in it; `start` where no row is directly before.

    `block` numbers stretches of contiguous time, in which motion is held out together. `repeats`: rows over which the recorded
    torque does not change, 1 where it does; `coarse`: variance that its steps make [(N·m)² or N²].
    """

    run: Index
    sample: Index
    start: NDArray[np.bool_]
    block: Index
    repeats: Array
    coarse: Array

    def __len__(self) -> int:
        return len(self.run)

    def every_one_counts(self) -> AxisRows:
        """The same rows of what was recorded without such steps."""
        return replace(self, repeats=np.ones(len(self)), coarse=np.zeros(len(self)))


@dataclass(frozen=True)
class Rows:
    """Prepared recordings, seen as rows: the samples of each axis that are fitted, thinned to what the filter leaves."""

    simulation: Simulation
    runs: Sequence[Run]
    blocks: int

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes."""
        return self.simulation.axes

    @cached_property
    def compared(self) -> tuple[str, ...]:
        """Names of all rows: torque of every axis, and its deflection where every recording has a second encoder."""
        told = [axis for axis in self.axes if all(run.axes[axis].motion.deflection is not None for run in self.runs)]
        return (*self.axes, *(deflection_of(axis) for axis in told))

    @cached_property
    def of(self) -> dict[str, AxisRows]:
        """The rows of each axis; its deflection is compared where its torque is."""
        torque = {axis: self._of(axis) for axis in self.axes}
        return {name: torque[name] if is_torque(name) else torque[axis_of(name)].every_one_counts() for name in self.compared}

    def _of(self, axis: str) -> AxisRows:
        picks = [np.flatnonzero(run.axes[axis].fitted[:: run.stride]) for run in self.runs]
        length = max(sum(len(pick) * run.stride * run.period for pick, run in zip(picks, self.runs, strict=True)), 1e-9)
        length /= self.blocks
        run_of, sample, start, block, repeats, coarse, passed = [], [], [], [], [], [], 0
        for number, (pick, run) in enumerate(zip(picks, self.runs, strict=True)):
            run_of.append(np.full(len(pick), number))
            sample.append(pick * run.stride)
            start.append(np.diff(pick, prepend=-2) > 1)
            at = (np.arange(len(pick)) * run.stride * run.period / length).astype(np.intp)
            block.append(passed + at)
            passed += int(at[-1]) + 1 if len(at) else 0
            own = run.axes[axis]
            repeats.append(np.maximum(own.unchanged[:: run.stride][pick] / (run.stride * run.period), 1.0))
            coarse.append(np.full(len(pick), own.step**2 / 12.0))
        return AxisRows(*(np.concatenate(parts) for parts in (run_of, sample, start, block, repeats, coarse)))

    def count(self, axis: str) -> int:
        """How many rows an axis has."""
        return len(self.of[axis])

    def rows(self, axis: str, of_run: Callable[[Run, AxisRun], Array]) -> Array:
        """What `of_run` gives for every sample (n,) of each recording and the axis in it, on the rows of the axis (N,)."""
        return self.picked(axis, [of_run(run, run.axes[axis]) for run in self.runs])

    def picked(self, axis: str, samples: Sequence[Array]) -> Array:
        """Every sample (n,) of each recording, on the rows of the axis (N,)."""
        return np.concatenate([values[own] for values, own in zip(samples, self._samples[axis], strict=True)])

    @cached_property
    def _samples(self) -> dict[str, list[Index]]:
        """Of each recording, the samples that are rows of each axis."""
        numbers = range(len(self.runs))
        return {axis: [rows.sample[rows.run == number] for number in numbers] for axis, rows in self.of.items()}

    def cost(self, axis: str, effect: AxisEffect, dynamics: AxisDynamics) -> dict[str, Array]:
        """Torque that an effect costs on its axis, and on those that feel its joint move otherwise than measured; and what it
        has the joint ahead of its motor, where that is compared."""
        costs = [run.cost(axis, effect, dynamics) for run in self.runs]
        felt = dict.fromkeys(name for cost in costs for name in cost)
        none = [np.zeros(len(run.recording.time)) for run in self.runs]
        found = {on: self.picked(on, [cost.get(on, zero) for cost, zero in zip(costs, none, strict=True)]) for on in felt}
        if deflection_of(axis) in self.compared:
            ahead = [run.deflected(axis, effect, dynamics) for run in self.runs]
            if any(one is not None for one in ahead):
                whole = [zero if one is None else one for one, zero in zip(ahead, none, strict=True)]
                found[deflection_of(axis)] = centred(self.picked(axis, whole), self.of[axis].run)
        return found

    def rigid_rows(self, of_motion: Callable[[Kinematics], Array]) -> dict[str, Array]:
        """Torque (n, k) that a rigid model needs for a motion of all axes, on the rows of each axis."""
        few = [run.kinematics.every(run.stride) for run in self.runs]
        torque = of_motion(Kinematics.joined(few))
        return self._thinned(np.split(torque, np.cumsum([len(each.position) for each in few])[:-1]))

    def _thinned(self, samples: Sequence[Array]) -> dict[str, Array]:
        """Torque (n, k) of all axes at every stride-th sample of each recording, on the rows of each axis."""
        found = {}
        for k, axis in enumerate(self.axes):
            picked = zip(samples, self._samples[axis], self.runs, strict=True)
            parts = [torque[own // run.stride, k] for torque, own, run in picked]
            found[axis] = np.concatenate(parts)
        return found

    def predicted_by_model(self, axis: str, effect: Effect) -> dict[str, Array]:
        """Torque that an effect on the rigid bodies costs, on every axis."""
        return self._beyond_rigid(self.simulation.rigid_with(axis, effect))

    def predicted_by_heavier(self, body: int) -> dict[str, Array]:
        """Torque that twice the mass and inertia of one body, by its number, costs besides, on every axis."""
        return self._beyond_rigid(self.simulation.rigid_with_heavier(body))

    def shifted(self, recording: str, axis: str) -> dict[str, Array]:
        """d torque / d position of one axis, in one recording, by its name, on the rows of every axis; 0 in the others."""

        def slopes(run: Run) -> Array:
            few = run.kinematics.every(run.stride)
            return self.simulation.slopes(few, axis) if run.recording.name == recording else np.zeros_like(few.position)

        return {name: torque * self.moves[name] for name, torque in self._thinned([slopes(run) for run in self.runs]).items()}

    def _beyond_rigid(self, changed: Model) -> dict[str, Array]:
        whole = self.rigid_rows(partial(self.simulation.torques_of, changed))
        return {name: (rows - self._rigid[name]) * self.moves[name] for name, rows in whole.items()}

    @cached_property
    def moves(self) -> dict[str, Array]:
        """Share of what a filtered row is made of in which its axis does not stick."""
        return {axis: self.rows(axis, lambda run, own: run.moves(own)) for axis in self.axes}

    @cached_property
    def _rigid(self) -> dict[str, Array]:
        return self.rigid_rows(self.simulation.torques)

    @cached_property
    def target(self) -> dict[str, Array]:
        """Measured torque less that of the simulation as it stands, by axis, and the measured deflections."""
        return {name: self._target(name) for name in self.compared}

    def _target(self, name: str) -> Array:
        if is_torque(name):
            return self.rows(name, lambda _, own: own.torque - own.base)
        axis = axis_of(name)
        motions = [run.axes[axis].motion for run in self.runs]
        ahead = [motion.deflection for motion in motions if motion.deflection is not None]
        return centred(self.picked(axis, ahead), self.of[axis].run)

    @cached_property
    def gap_energy(self) -> dict[str, float]:
        """Sum of squares of `target` [(N·m)² or N²], by axis."""
        return {axis: float(rows @ rows) for axis, rows in self.target.items()}

    @cached_property
    def measured(self) -> dict[str, Array]:
        """Measured torque, by axis."""
        return {axis: self.rows(axis, lambda _, own: own.torque) for axis in self.axes}

    @cached_property
    def size(self) -> dict[str, float]:
        """Rms of the measured torque of each axis less its weight [N·m or N], and of each deflection [rad or m]."""
        ahead = {
            name: float(np.hypot(_rms(self.target[name]), self._grain(name))) for name in self.compared if not is_torque(name)
        }
        return {axis: _rms(self.rows(axis, lambda _, own: own.of_motion)) for axis in self.axes} | ahead

    def _grain(self, name: str) -> float:
        """Of a deflection: the quantum of both encoders' positions, which differ by so much for nothing [rad or m]."""
        told = [run.recording.info.axes[axis_of(name)].position_resolution or 0.0 for run in self.runs]
        return max(*told, 1e-9)

    def deflects(self, axis: str) -> bool:
        """Whether a second encoder shows more than the quanta of both."""
        name = deflection_of(axis)
        return name in self.compared and float(np.ptp(self.target[name])) > 2.0 * self._grain(name)

    @cached_property
    def motion(self) -> dict[str, Motion]:
        """All motion of each axis joined, recording after recording: where a search for an effect begins does not depend on
        which of them comes first or is longest."""
        return {axis: _joined([run.axes[axis] for run in self.runs]) for axis in self.axes}

    @cached_property
    def searched(self) -> Rows:
        """What a search decides on: a part of it, where recordings are so long that all of them would only take longer."""
        return self._spread(self._searched, self, 1)

    @cached_property
    def part(self) -> Rows:
        """What a search begins on: a smaller part of it; `searched` where that is hardly more."""
        share = ENOUGH / sum(len(run.recording.time) * run.period for run in self.runs)
        return self._spread(share, self.searched, PIECES) if share * MUCH < self._searched else self.searched

    @property
    def _searched(self) -> float:
        share = SEARCHED / sum(len(run.recording.time) for run in self.runs)
        return share if share * MUCH < 1.0 else 1.0

    def _spread(self, share: float, instead: Rows, pieces: int) -> Rows:
        """A share of it, spread over all recordings; something else `instead` where an axis hardly moves in that."""
        if share == 1.0:
            return self
        part = Rows(self.simulation, [piece for run in self.runs for piece in _pieces(run, share, pieces)], self.blocks)
        fair = all(part.count(axis) >= 0.4 * share * self.count(axis) for axis in self.axes)
        return part if fair else instead


def _pieces(run: Run, share: float, least: int) -> list[Run]:
    """Pieces of a recording, evenly over it: as many as are long, and no fewer than the `least`."""
    whole = len(run.recording.time)
    count = max(least, int(share * whole * run.period / PIECE))
    length = max(int(share * whole / count), int(4.0 / (run.cutoff_hz * run.period)) * 4)
    if length * count >= whole:
        return [run]
    begins = np.linspace(0, whole - length, count).astype(int)
    return [run.piece(slice(int(begin), int(begin) + length)) for begin in begins]


def _joined(runs: Sequence[AxisRun]) -> Motion:
    first = runs[0].motion
    if len(runs) == 1:
        return first
    each = [sampled(run.motion) for run in runs]
    samples: dict[str, Any] = dict.fromkeys(each[0])
    samples |= {name: np.concatenate([one[name] for one in each]) for name in each[0] if all(name in one for one in each)}
    return replace(first, band=max(run.motion.band for run in runs), sampling=None, **samples)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
