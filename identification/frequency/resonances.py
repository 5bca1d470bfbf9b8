"""Resonances and anti-resonances of the mechanics, and the inertia: what tells a stiff axis from an elastic one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from drivetwin.identification.frequency.bode import Bode
from drivetwin.identification.frequency.margins import decibel
from drivetwin.identification.frequency.phasors import Complex
from drivetwin.recording.recording import Samples

PROMINENCE = 3.0
"""How far a peak of the acceleration for a torque stands out [dB]; an inertia's is level."""

BELOW = 0.8
"""Of the first anti-resonance."""


@dataclass(frozen=True)
class Resonances:
    """Frequencies [Hz] at which the motor moves most and least for a torque, beside what its inertia makes of it."""

    resonances: tuple[float, ...]
    antiresonances: tuple[float, ...]


def find_resonances(found: Bode) -> Resonances:
    """Of the reliable lines, between the lowest and the highest."""
    return resonances_of(found.frequency[found.sure], found.mechanics[found.sure])


def resonances_of(frequency: Samples, mechanics: Complex) -> Resonances:
    """Of speed over torque (m,) at rising frequencies (m,) [Hz], between the lowest and the highest."""
    acceleration = np.abs(mechanics) * frequency
    return Resonances(_dips(frequency, 1.0 / acceleration), _dips(frequency, acceleration))


def inertia(found: Bode, shapes: Resonances) -> float:
    """All that the motor moves at low frequency [kg·m² or kg]: weighted least squares of torque over acceleration.

    Below an anti-resonance at f0 it is motor + load / (1 - f²/f0²) of a two-mass drive, fitted up to `BELOW` of f0; an axis
    without one is an inertia at all lines.
    """
    frequency = found.frequency[found.sure]
    measured = (1.0 / found.mechanics[found.sure]).imag / (2.0 * np.pi * frequency)
    weight = 1.0 / found.deviation[found.sure]
    lowest = min(shapes.antiresonances, default=np.inf)
    low = frequency < BELOW * lowest
    if low.sum() < 2 or not np.isfinite(lowest):
        return float((weight**2 * measured).sum() / (weight**2).sum())
    parts = np.column_stack([np.ones(int(low.sum())), 1.0 / (1.0 - (frequency[low] / lowest) ** 2)])
    return float(np.linalg.lstsq(parts * weight[low, None], (measured * weight)[low], rcond=None)[0].sum())


def _dips(frequency: Samples, size: Samples) -> tuple[float, ...]:
    """Where `size` (m,) [1], up to a factor that of 1 - f²/f0², goes through 0.

    Where an axis hardly answers or moves most, lines are seldom reliable: those on either side of such a gap tell where f0 is.
    """
    return tuple(_through_zero(frequency**2, size, int(at)) for at in find_peaks(-decibel(size), prominence=PROMINENCE)[0])


def _through_zero(square: Samples, size: Samples, at: int) -> float:
    """f0 [Hz] by a straight line over f² from the lowest line to its neighbour beyond f0, which the chord of both tells."""
    chord = np.interp(square[at], square[[at - 1, at + 1]], [-size[at - 1], size[at + 1]])
    beyond = at - 1 if chord > 0.0 else at + 1
    share = size[at] / (size[at] + size[beyond])
    return float(np.sqrt(square[at] + share * (square[beyond] - square[at])))
