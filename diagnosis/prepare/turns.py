"""Recordings whose position has a zero of its own, placed by what their torque repeats every turn of the motor.

An encoder without a reference counts from where a recording began, and so does a position that was integrated from a velocity.
Where the model's torque does not depend on the position either, a screw that is bent or a motor that cogs still tells where
in a turn it stands: the same wave, of one and several periods a turn, in every recording.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.prepare.simulation import Simulation

Array = NDArray[np.float64]

WAVES = 4
"""Waves a turn up to which the wave's shape is found: what is bent or out of centre has one and two."""
LEAST_TURNS = 2.0
"""In a recording, to distinguish a whole number of waves a turn from those half a wave beside it."""
STANDS_OUT = 4.0
"""Times the energy of as many waves half a wave beside, on either side: noise that falls with the square of the frequency has
twice that of the higher ones, and less than that of the lower ones."""
ANGLES = 360
"""Zeros over a turn that are tried."""
ROUNDS = 20
"""Times that the wave's shape and the zeros are found in turn, at most."""
DEPENDS = 0.01
"""Share of the torque by which the model's may change over a turn, to leave the zero open."""


@dataclass(frozen=True)
class Turned:
    """Training and validation recordings, of which some axes are placed within a turn of the motor: `axes`.

    `one_way`: those that go one way in every recording. A wave of the friction, which changes its sign with the direction,
    would have placed them as well.
    """

    runs: list[Run]
    checks: list[Run]
    axes: frozenset[str] = frozenset()
    one_way: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()


def placed_within_a_turn(simulation: Simulation, runs: Sequence[Run], checks: Sequence[Run], adrift: Collection[str]) -> Turned:
    """Moves the position of each axis that is `adrift` to where its torque has the same wave in all recordings.

    An axis stays as it is where its model's torque depends on the position, or no wave of a motor turn stands out in most of
    the recordings that have some turns.
    """
    found = Turned(list(runs), list(checks))
    for axis in (axis for axis in simulation.axes if axis in adrift):
        turn = 2.0 * np.pi / simulation.dynamics()[axis].gear_ratio
        if any(_depends(simulation, run, axis, turn) for run in runs):
            continue
        own = [_Waves.of(run, axis, turn) for run in found.runs]
        told = [one for one in own if one.turns >= LEAST_TURNS]
        if len(told) < 2 or sum(one.stands_out for one in told) <= 0.5 * len(told):
            continue
        shape = _common_shape(told)
        placed = [_placed(run, axis, one.zero(shape) * turn, turn) for run, one in zip(found.runs, own, strict=True)]
        others = [_placed(run, axis, _Waves.of(run, axis, turn).zero(shape) * turn, turn) for run in found.checks]
        one_way = found.one_way | ({axis} if all(_goes_one_way(run, axis) for run in runs) else set())
        note = f"{axis}: the position is relative; each recording is placed by the wave of its torque over a turn of the motor."
        found = Turned(placed, others, found.axes | {axis}, one_way, (*found.notes, note))
    return found


@dataclass(frozen=True)
class _Waves:
    """What one recording's torque tells of waves of a motor turn, a cosine and a sine for each number of them a turn.

    `gram` (2 W, 2 W) and `right` (2 W,): of least squares beside a level, a friction and a slope. `energy`: what the waves
    explain; `beside`: what as many explain half a wave below or above them.
    """

    turns: float
    gram: Array
    right: Array
    energy: float
    beside: float

    @classmethod
    def of(cls, run: Run, axis: str, turn: float) -> _Waves:
        own = run.axes[axis]
        rows = np.flatnonzero(own.fitted[:: run.stride]) * run.stride
        left, angle = (own.torque - own.base)[rows], 2.0 * np.pi * own.motion.position / turn
        velocity = own.motion.velocity[rows]
        free = _orthonormal(np.column_stack([np.ones(len(rows)), np.sign(velocity), velocity]))

        def beside_free(orders: Array) -> Array:
            waves = [run.felt(own, wave(order * angle))[rows] for order in orders for wave in (np.cos, np.sin)]
            columns = np.column_stack(waves)
            return columns - free @ (free.T @ columns)

        numbers = np.arange(1.0, WAVES + 1.0)
        whole = beside_free(numbers)
        beside = max(_explained(beside_free(numbers + half), left) for half in (-0.5, 0.5))
        turns = float(np.ptp(angle[rows])) / (2.0 * np.pi) if len(rows) else 0.0
        return cls(turns, whole.T @ whole, whole.T @ left, _explained(whole, left), beside)

    @property
    def stands_out(self) -> bool:
        """Whether whole numbers of waves a turn explain much more than others."""
        return self.energy > STANDS_OUT * self.beside

    def zero(self, shape: Array) -> float:
        """Where in a turn, from -1/2 to 1/2, a position of 0 stands, by a wave of that shape (2 W,)."""
        tried = _every_angle(shape)
        gain = 2.0 * tried @ self.right - np.sum((tried @ self.gram) * tried, axis=1)
        return float(_PARTS[int(np.argmax(gain))])


_PARTS = (np.arange(ANGLES) - ANGLES // 2) / ANGLES


def _common_shape(every: Sequence[_Waves]) -> Array:
    """The wave (2 W,) that all recordings have, each at a zero of its own: shape and zeros in turn, from the strongest on."""
    strongest = max(every, key=lambda one: one.energy)
    shape, zeros = _solved(strongest.gram, strongest.right), np.array([])
    for _ in range(ROUNDS):
        last, zeros = zeros, np.array([one.zero(shape) for one in every])
        if np.array_equal(last, zeros):
            break
        turned = [_turning(zero) for zero in zeros]
        gram = sum(turn.T @ one.gram @ turn for turn, one in zip(turned, every, strict=True))
        shape = _solved(np.asarray(gram), np.asarray(sum(turn.T @ one.right for turn, one in zip(turned, every, strict=True))))
    return shape


def _every_angle(shape: Array) -> Array:
    """A shape (2 W,) as it is told from each of the zeros (A, 2 W)."""
    return np.array([_turning(part) @ shape for part in _PARTS])


def _turning(part: float) -> Array:
    """(2 W, 2 W): coefficients of a shape, where angles are counted from a `part` of a turn before its own zero."""
    found = np.zeros((2 * WAVES, 2 * WAVES))
    for k in range(WAVES):
        angle = 2.0 * np.pi * (k + 1) * part
        cos, sin = np.cos(angle), np.sin(angle)
        found[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[cos, sin], [-sin, cos]]
    return found


def _orthonormal(columns: Array) -> Array:
    """(N, at most q): what columns (N, q) span."""
    vectors, sizes, _ = np.linalg.svd(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), full_matrices=False)
    return np.asarray(vectors[:, sizes > 1e-6])


def _explained(columns: Array, left: Array) -> float:
    basis = _orthonormal(columns)
    return float(np.sum((basis.T @ left) ** 2))


def _solved(gram: Array, right: Array) -> Array:
    return np.asarray(np.linalg.lstsq(gram, right, rcond=1e-9)[0])


def _placed(run: Run, axis: str, zero: float, turn: float) -> Run:
    return run.placed({axis: zero}).within({axis: turn})


def _goes_one_way(run: Run, axis: str) -> bool:
    own = run.axes[axis]
    return len(np.unique(np.sign(own.motion.velocity[own.fitted]))) <= 1


def _depends(simulation: Simulation, run: Run, axis: str, turn: float) -> bool:
    """Whether any axis's torque, as the model has it, changes with the angle of one axis's motor."""
    few = run.kinematics.every(max(1, len(run.recording.time) // 200))
    change = np.abs(simulation.slopes(few, axis)).max(axis=0) * turn
    sizes = [np.sqrt(np.mean(own.torque**2)) for own in run.axes.values()]
    return bool(np.any(change > DEPENDS * np.maximum(sizes, 1e-12)))
