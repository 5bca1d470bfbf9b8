"""Five laws of friction with presliding, each advanced by a step and linear in the velocity that the step ends with."""

from __future__ import annotations

from math import exp, pi, sin

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.wide.truth import COULOMB, DAHL, GMS, LUGRE, Record
from drivetwin.foundation.compiled import compiled

ELEMENTS = 4
"""Springs side by side of `maxwell_slip` and `gms`."""

WEIGHTS = np.arange(1, ELEMENTS + 1) / sum(range(1, ELEMENTS + 1))
"""Share of the level at which each of them slips (Al-Bender, Lampaert, Swevers 2005); all springs are equal."""

Array = NDArray[np.float64]


def yielding_way(slide: bool) -> tuple[float, float]:
    """On which real friction yields at least and at most before it slides: 10 um to 1 mm, or 0.1 to 10 mrad."""
    return (1e-5, 1e-3) if slide else (1e-4, 1e-2)


@compiled
def level(axis: Record, position: float, velocity: float, torque: float, time: float) -> float:
    """Friction that the axis slides with, viscous part aside [N·m or N]: at least a hundredth of its Coulomb friction.

    Armstrong-Hélouvry et al. 1994 eq. 4, asymmetry after Janot et al. 2019, load and warming after Bittencourt and Gunnarsson
    2012.
    """
    falling = axis.static * exp(-((abs(velocity) / axis.stribeck_velocity) ** axis.exponent))
    wave = axis.wave * sin(2.0 * pi * position / axis.wave_period + axis.wave_phase)
    sliding = axis.coulomb + falling + wave + axis.load_coefficient * abs(torque) + axis.asymmetry * np.sign(velocity)
    return float(max(sliding * warmth(axis, time), 0.01 * axis.coulomb))


@compiled
def warmth(axis: Record, time: float) -> float:
    """Factor of all friction `time` seconds after it was switched on."""
    return 1.0 + axis.cold * exp(-time / axis.warming_time)


@compiled
def viscous(axis: Record, velocity: float, time: float) -> tuple[float, float]:
    """Viscous torque, and its slope over the velocity."""
    speed, warm = abs(velocity), warmth(axis, time)
    linear = axis.viscous + axis.viscous_asymmetry * np.sign(velocity)
    torque = (linear + axis.quadratic * speed + axis.cubic * speed**2) * velocity
    slope = linear + 2.0 * axis.quadratic * speed + 3.0 * axis.cubic * speed**2
    return torque * warm, max(slope * warm, 0.0)


@compiled
def presliding(axis: Record, state: Array, limit: float, velocity: float, step: float, after: Array) -> tuple[float, float]:
    """Torque at the end of a `step` [s] at `velocity` throughout and its slope over that velocity; `after` gets the new state.

    `state` is (ELEMENTS,): the torque of each spring, of `lugre` and `dahl` in the first. It slides at `limit`.
    """
    if axis.law == LUGRE:
        return _lugre(axis, state, limit, velocity, step, after)
    if axis.law == DAHL:
        return _dahl(axis, state, limit, velocity, step, after)
    if axis.law == GMS:
        return _gms(axis, state, limit, velocity, step, after)
    return _maxwell(axis, state, limit, velocity, step, after)


@compiled
def _lugre(axis: Record, state: Array, limit: float, velocity: float, step: float, after: Array) -> tuple[float, float]:
    """Canudas de Wit et al. 1995: z' = v - stiffness |v| z / level, torque = stiffness z + micro_damping z'."""
    left = 1.0 / (1.0 + step * axis.stiffness * abs(velocity) / limit)
    after[0] = (state[0] + step * axis.stiffness * velocity) * left
    damping = axis.micro_damping / axis.stiffness / step
    slope = step * axis.stiffness * max(0.0, 1.0 - state[0] / limit * np.sign(velocity)) * left**2
    return after[0] + damping * (after[0] - state[0]), slope * (1.0 + damping)


@compiled
def _dahl(axis: Record, state: Array, limit: float, velocity: float, step: float, after: Array) -> tuple[float, float]:
    """Dahl 1968: dF/dx = stiffness |1 - F/level sgn v|^exponent sgn(1 - F/level sgn v)."""
    room = 1.0 - state[0] / limit * np.sign(velocity)
    slope = axis.stiffness * np.sign(room) * abs(room) ** axis.dahl_exponent
    moved = state[0] + slope * velocity * step
    after[0] = min(max(moved, -limit), limit)
    slope = slope if moved == after[0] else 0.0
    return after[0] + axis.micro_damping * slope / axis.stiffness * velocity, max(slope, 0.0) * step


@compiled
def _maxwell(axis: Record, state: Array, limit: float, velocity: float, step: float, after: Array) -> tuple[float, float]:
    """Maxwell slip: springs that yield one after the other; one alone for the law of Coulomb."""
    torque, slope = 0.0, 0.0
    count = ELEMENTS if axis.law != COULOMB else 1
    for k in range(count):
        most = limit * WEIGHTS[k] if count > 1 else limit
        moved = state[k] + axis.stiffness / count * velocity * step
        after[k] = min(max(moved, -most), most)
        torque += after[k]
        if moved == after[k]:
            torque += axis.micro_damping / count * velocity
            slope += axis.stiffness / count * step + axis.micro_damping / count
    return torque, slope


@compiled
def _gms(axis: Record, state: Array, limit: float, velocity: float, step: float, after: Array) -> tuple[float, float]:
    """Generalised Maxwell slip (Lampaert, Al-Bender, Swevers 2003): what slips follows its share of the level with a lag."""
    torque, slope = 0.0, 0.0
    for k in range(ELEMENTS):
        most = limit * WEIGHTS[k]
        moved = state[k] + axis.stiffness / ELEMENTS * velocity * step
        if abs(moved) <= most or moved * velocity < 0.0:
            after[k] = moved
            torque += moved + axis.micro_damping / ELEMENTS * velocity
            slope += axis.stiffness / ELEMENTS * step + axis.micro_damping / ELEMENTS
        else:
            excess = max(abs(state[k]) - most, 0.0) if state[k] * velocity > 0.0 else 0.0
            after[k] = np.sign(velocity) * (most + excess / (1.0 + step * axis.attraction))
            torque += after[k]
    return torque, slope
