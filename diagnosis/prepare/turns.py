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
from drivetwin.diagnosis.prepare.spanned import orthonormal
from drivetwin.diagnosis.prepare.testable import LEAST_EACH_WAY
from drivetwin.emulator.dynamics import Motion

Array = NDArray[np.float64]

WAVES = 4
"""Waves a turn up to which the wave's shape is found: what is bent or out of centre has one and two."""
LEAST_TURNS = 2.0
"""In a recording, to distinguish a whole number of waves a turn from those half a wave beside it."""
STANDS_OUT = 4.0
"""Times the energy of as many waves half a wave beside, on either side: noise that falls with the square of the frequency has
twice that of the higher ones, and less than that of the lower ones."""
ALIKE = 0.02
"""Of what one wave explains, that another may explain less, for both to be the same."""
SPEEDS = 8
"""Speeds, evenly from 0 to the highest, that friction is a curve over."""
HOW = "each recording is placed by the wave of its torque over a turn of the motor, whose phase counts from there"
ANGLES = 360
"""Zeros over a turn that are tried."""
ROUNDS = 20
"""Times that the wave's shape and the zeros are found in turn, at most."""
DEPENDS = 0.01
"""Share of the torque by which the model's may change over a turn, to leave the zero open."""


@dataclass(frozen=True)
class Turned:
    """Training and validation recordings, of which some axes are placed within a turn of the motor: `axes`.

    `one_way`: those that go one way in every recording, and that a wave of the torque places as well as one of the friction.
    """

    runs: list[Run]
    checks: list[Run]
    axes: frozenset[str] = frozenset()
    one_way: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()


def placed_within_a_turn(simulation: Simulation, runs: Sequence[Run], checks: Sequence[Run], adrift: Collection[str]) -> Turned:
    """Moves the position of each axis that is `adrift` to where its torque has the same wave in all recordings.

    An axis stays as it is where its model's torque depends on the position, or no wave of a motor turn stands out in most of
    the recordings that have some turns. The wave is one of the torque, or one of the friction, which changes its sign with the
    direction: the one that explains more.
    """
    found = Turned(list(runs), list(checks))
    for axis in (axis for axis in simulation.axes if axis in adrift):
        turn = 2.0 * np.pi / simulation.dynamics()[axis].gear_ratio
        if any(_depends(simulation, run, axis, turn) for run in runs):
            continue
        tried = [wave for flips in (False, True) if (wave := _wave_of(found.runs, axis, turn, flips)) is not None]
        if not tried:
            continue
        best = max(tried, key=lambda one: one.explains)
        alike = len(tried) > 1 and min(one.explains for one in tried) > (1.0 - ALIKE) * best.explains
        one_way = alike and all(_goes_one_way(run, axis) for run in runs)
        found = Turned(
            [best.placed(run) for run in found.runs],
            [best.placed(run) for run in found.checks],
            found.axes | {axis},
            found.one_way | ({axis} if one_way else set()),
            (*found.notes, f"{axis}: the position is relative; {HOW}."),
        )
    return found


@dataclass(frozen=True)
class _Wave:
    """A wave of an axis that all recordings have: its shape (2 W,), and how much of their energy it explains.

    `flips`: whether it changes its sign with the direction.
    """

    axis: str
    turn: float
    flips: bool
    shape: Array
    explains: float

    def placed(self, run: Run) -> Run:
        """A recording, moved to where it has the wave; as it is where its axis stands."""
        zero = _Waves.of(run, self.axis, self.turn, self.flips).zero(self.shape)
        return run.placed({self.axis: zero * self.turn}).within({self.axis: self.turn})


def _wave_of(runs: Sequence[Run], axis: str, turn: float, flips: bool) -> _Wave | None:
    """None where none stands out."""
    own = [_Waves.of(run, axis, turn, flips) for run in runs]
    told = [one for one in own if one.turns >= LEAST_TURNS]
    if len(told) < 2 or sum(one.stands_out for one in told) <= 0.5 * len(told):
        return None
    shape = _common_shape(told)
    return _Wave(axis, turn, flips, shape, sum(one.gain(shape) for one in told))


@dataclass(frozen=True)
class _Waves:
    """What one recording's torque tells of waves of a motor turn, a cosine and a sine for each number of them a turn.

    `gram` (2 W, 2 W) and `right` (2 W,): of least squares beside what velocity and acceleration explain. `energy`: what the
    waves explain; `beside`: what as many explain half a wave below or above them.
    """

    turns: float
    gram: Array
    right: Array
    energy: float
    beside: float

    @classmethod
    def of(cls, run: Run, axis: str, turn: float, flips: bool) -> _Waves:
        own = run.axes[axis]
        rows = np.flatnonzero(own.fitted[:: run.stride]) * run.stride
        left, angle = (own.torque - own.base)[rows], 2.0 * np.pi * own.motion.position / turn
        sign = np.sign(own.motion.velocity) if flips else np.ones(len(angle))
        free = orthonormal(np.column_stack([run.felt(own, each)[rows] for each in _of_motion(own.motion)]))

        def beside_free(orders: Array) -> Array:
            waves = [run.felt(own, sign * wave(order * angle))[rows] for order in orders for wave in (np.cos, np.sin)]
            columns = np.column_stack(waves)
            return columns - free @ (free.T @ columns)

        numbers = np.arange(1.0, WAVES + 1.0)
        whole = beside_free(numbers)
        beside = max(_explained(beside_free(numbers + half), left) for half in (-0.5, 0.5))
        way = float(np.ptp(angle[rows])) / (2.0 * np.pi) if len(rows) else 0.0
        return cls(way, whole.T @ whole, whole.T @ left, _explained(whole, left), beside)

    @property
    def stands_out(self) -> bool:
        """Whether whole numbers of waves a turn explain much more than others."""
        return self.energy > STANDS_OUT * self.beside

    def zero(self, shape: Array) -> float:
        """Where in a turn, from -1/2 to 1/2, a position of 0 stands, by a wave of that shape (2 W,); 0 where nothing tells."""
        return float(_PARTS[int(np.argmax(self._gains(shape)))]) if self.gram.any() else 0.0

    def gain(self, shape: Array) -> float:
        """Energy that a wave of that shape explains, wherever it is best."""
        return float(np.max(self._gains(shape)))

    def _gains(self, shape: Array) -> Array:
        tried = _every_angle(shape)
        return np.asarray(2.0 * tried @ self.right - np.sum((tried @ self.gram) * tried, axis=1))


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


def _explained(columns: Array, left: Array) -> float:
    basis = orthonormal(columns)
    return float(np.sum((basis.T @ left) ** 2))


def _solved(gram: Array, right: Array) -> Array:
    return np.asarray(np.linalg.lstsq(gram, right, rcond=1e-9)[0])


def _of_motion(motion: Motion) -> list[Array]:
    """Columns (n,) for friction of any curve over the speed, by direction, and for an inertia.

    What happens at both ends of a stroke of some whole turns comes back every turn as well.
    """
    at = np.linspace(0.0, max(float(np.abs(motion.velocity).max()), 1e-12), SPEEDS)
    hats = [np.interp(np.abs(motion.velocity), at, unit) for unit in np.eye(SPEEDS)]
    return [motion.acceleration, *hats, *(np.sign(motion.velocity) * hat for hat in hats)]


def _goes_one_way(run: Run, axis: str) -> bool:
    own = run.axes[axis]
    forwards = float(np.mean(own.motion.velocity[own.fitted] > 0.0)) if own.fitted.any() else 0.0
    return min(forwards, 1.0 - forwards) < LEAST_EACH_WAY


def _depends(simulation: Simulation, run: Run, axis: str, turn: float) -> bool:
    """Whether any axis's torque, as the model has it, changes with the angle of one axis's motor."""
    few = run.kinematics.every(max(1, len(run.recording.time) // 200))
    change = np.abs(simulation.slopes(few, axis)).max(axis=0) * turn
    sizes = [np.sqrt(np.mean(own.torque**2)) for own in run.axes.values()]
    return bool(np.any(change > DEPENDS * np.maximum(sizes, 1e-12)))
