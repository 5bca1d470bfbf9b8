"""How far an open loop is from instability, by what was measured of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from drivetwin.identification.frequency.phasors import Complex
from drivetwin.recording.recording import Samples


@dataclass(frozen=True)
class Margins:
    """`crossover` [Hz] and `phase` margin [degrees] there; `gain` margin [dB] at `phase_crossover` [Hz]; `peak` of the
    sensitivity 1/(1 + L) [dB]. None where the loop does not cross within what was measured."""

    crossover: float | None
    phase: float | None
    phase_crossover: float | None
    gain: float | None
    peak: float


def decibel(values: Complex | Samples) -> Samples:
    """20 log10 of the magnitude (m,)."""
    return np.asarray(20.0 * np.log10(np.maximum(np.abs(values), 1e-300)))


def degrees(values: Complex) -> Samples:
    """Unwrapped phase (m,) [degrees]; the first one between -360 and 0, as a loop with an integrator begins."""
    phase = np.degrees(np.unwrap(np.angle(values)))
    return np.asarray(phase - 360.0 * np.ceil(phase[0] / 360.0)) if len(phase) else phase


def margins(frequency: Samples, loop: Complex) -> Margins:
    """The least phase margin of all crossings of 0 dB, the least gain margin of all crossings of -180°.

    Between the lines by straight lines over the logarithm of the frequency. Franklin, Powell, Emami-Naeini, Feedback Control of
    Dynamic Systems, 2019, 6.4.
    """
    level, phase, at = decibel(loop), degrees(loop), np.log(frequency)
    around = (phase + 360.0) % 360.0 - 180.0  # of -180 degrees
    phase_margin, crossover = _least((float(np.interp(x, at, phase + 180.0)), x) for x in _zeros(at, level))
    gain_margin, phase_crossover = _least((-float(np.interp(x, at, level)), x) for x in _zeros(at, around, leap=180.0))
    return Margins(crossover, phase_margin, phase_crossover, gain_margin, float(decibel(1.0 / (1.0 + loop)).max()))


def _least(found: Iterable[tuple[float, float]]) -> tuple[float, float] | tuple[None, None]:
    """The least margin and its frequency [Hz], of margins and logarithms of frequencies; none where there are none."""
    margin, place = min(found, default=(None, None))
    return (None, None) if margin is None or place is None else (margin, float(np.exp(place)))


def _zeros(at: Samples, values: Samples, leap: float = np.inf) -> list[float]:
    """Where straight lines between the points cross zero; a step of `leap` or more is an angle's, and no crossing."""
    before, after = values[:-1], values[1:]
    places = np.flatnonzero((np.sign(before) != np.sign(after)) & (np.abs(after - before) < leap))
    share = before[places] / (before[places] - after[places])
    return [float(x) for x in at[places] + share * (at[places + 1] - at[places])]
