"""The one low-pass filter: measured torque and every regressor pass it, so that neither lags the other.

Zero-phase 4th-order Butterworth, forward and backward (Gautier 1997; Janot, Vandanjon, Gautier 2014: "parallel
filtering" of the inverse dynamic identification model).
"""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np
from scipy import signal

from drivetwin.foundation.compiled import compiled
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Samples

_ORDER = 4
_FEWEST, _MOST = 3, 8
"""Samples on each side of one, from which its derivative is made."""
_ENOUGH = 0.95
"""Share of an acceleration at the cut-off that a derivative of it gives, if so many samples are enough."""
_HIGHEST_SHARE_OF_RATE = 0.4
_LONGEST = 10_000_000
"""Samples: beyond it no recording is long enough, and the order of magnitude says so."""


def effective_cutoff(period: float, cutoff_hz: float) -> float:
    """The cut-off that a recording of this sample period [s] can have: at most 0.4 of its sample rate [Hz]."""
    if not cutoff_hz > 0:
        raise UserError(f"a cut-off of {cutoff_hz:g} Hz filters everything away: give a positive one with --cutoff")
    return min(cutoff_hz, _HIGHEST_SHARE_OF_RATE / period)


@lru_cache(maxsize=64)
def _sections(period: float, cutoff_hz: float) -> Samples:
    """Second-order sections of the filter, (2, 6)."""
    return np.asarray(signal.butter(_ORDER, cutoff_hz, fs=1.0 / period, output="sos"), dtype=np.float64)


@lru_cache(maxsize=64)
def _settled(period: float, cutoff_hz: float) -> Samples:
    """State (2, 2) of the sections once a constant 1 has passed them for long."""
    return np.asarray(signal.sosfilt_zi(_sections(period, cutoff_hz)), dtype=np.float64)


@lru_cache(maxsize=64)
def reach(period: float, cutoff_hz: float) -> int:
    """Samples after which the response to an impulse has fallen below 2 % of its peak for good."""
    half = int(np.ceil(2.0 / (cutoff_hz * period)))
    if half > _LONGEST:
        return half
    impulse = np.zeros(2 * half + 1)
    impulse[half] = 1.0
    response = np.abs(signal.sosfiltfilt(_sections(period, cutoff_hz), impulse, padtype=None))
    return int(np.flatnonzero(response[half:] > 0.02 * response.max()).max()) + 1


def zero_phase(samples: Samples, period: float, cutoff_hz: float) -> Samples:
    """Low-pass `samples` (n,) taken every `period` [s] without shifting them in time."""
    padding = min(3 * reach(period, cutoff_hz), len(samples) - 1)
    filtered = np.array(samples, dtype=np.float64)
    _there_and_back(_sections(period, cutoff_hz), _settled(period, cutoff_hz), filtered, padding)
    return filtered


@compiled
def _pass_through(sections, settled, samples):  # type: ignore[no-untyped-def]
    """Two second-order sections in one pass over `samples`, in place: transposed direct form II, as `scipy.signal.sosfilt`.

    What does not wait for the sample before is added first: the sums of `sosfilt` in another order.
    """
    b0, b1, b2, _, a1, a2 = sections[0]
    c0, c1, c2, _, d1, d2 = sections[1]
    first, second = settled[0, 0] * samples[0], settled[0, 1] * samples[0]
    third, fourth = settled[1, 0] * samples[0], settled[1, 1] * samples[0]
    for k in range(len(samples)):
        sample = samples[k]
        between = b0 * sample + first
        first = (b1 * sample + second) - a1 * between
        second = b2 * sample - a2 * between
        out = c0 * between + third
        third = (c1 * between + fourth) - d1 * out
        fourth = c2 * between - d2 * out
        samples[k] = out


@compiled
def _there_and_back(sections, settled, samples, padding) -> None:  # type: ignore[no-untyped-def]
    """The filter forward and backward, in place; at both ends so many samples more, the others turned about the last."""
    count = len(samples)
    padded = np.empty(count + 2 * padding)
    padded[padding : padding + count] = samples
    for k in range(padding):
        padded[k] = 2.0 * samples[0] - samples[padding - k]
        padded[padding + count + k] = 2.0 * samples[-1] - samples[count - 2 - k]
    _pass_through(sections, settled, padded)
    _pass_through(sections, settled, padded[::-1])
    samples[:] = padded[padding : padding + count]


def derivative(samples: Samples, period: float) -> Samples:
    """Central difference (x[k+1] - x[k-1]) / (2 period), one-sided at the two ends; (n,)."""
    return np.asarray(np.gradient(samples, period), dtype=np.float64)


def fine_derivative(samples: Samples, period: float, cutoff_hz: float) -> Samples:
    """Central difference, (n,), of what passes a cut-off: over seven samples, or as many more as it takes (`half_width`), fewer
    near the two ends.

    Of all such differences it is exact for polynomials of the highest degree (Fornberg, Math. Comp. 51(184), 1988).
    """
    slope = derivative(samples, period)
    if len(samples) < 2 * _FEWEST + 1:
        return slope
    one = samples[4:-2] - samples[2:-4]
    two = samples[5:-1] - samples[1:-5]
    three = samples[6:] - samples[:-6]
    slope[3:-3] = (45.0 * one - 9.0 * two + three) / (60.0 * period)
    for half in range(_FEWEST + 1, half_width(period, cutoff_hz) + 1):
        if len(samples) > 2 * half:
            slope[half:-half] = np.convolve(samples, _weights(half)[::-1], mode="valid") / period
    return slope


@lru_cache(maxsize=64)
def half_width(period: float, cutoff_hz: float) -> int:
    """Samples on each side of one, from which its derivative is made: as few as give most of an acceleration at a cut-off."""
    angle = np.array([2.0 * np.pi * effective_cutoff(period, cutoff_hz) * period])
    widths = range(_FEWEST, _MOST)
    return next((half for half in widths if fine_slope(angle, half)[0] ** 2 >= _ENOUGH), _MOST)


def fine_slope(angle: Samples, half: int) -> Samples:
    """Share (n,) of the derivative of a sine that a difference over `half` samples on each side gives, by the angle [rad] that
    the sine turns in a sample: over seven samples 98 % at 0.2 of the sample rate and 84 % at 0.3, over 17 all and 99 %.
    """
    passed = 2.0 * np.sin(np.multiply.outer(angle, np.arange(1, half + 1))) @ _weights(half)[half + 1 :]
    return np.divide(passed, angle, out=np.ones_like(angle), where=angle > 0.0)


@lru_cache(maxsize=_MOST)
def _weights(half: int) -> Samples:
    """Of the samples from `half` before to `half` behind, (2 half + 1,)."""
    steps = range(1, half + 1)
    after = [(-1) ** (k + 1) * factorial(half) ** 2 / (k * factorial(half - k) * factorial(half + k)) for k in steps]
    return np.array([*(-weight for weight in after[::-1]), 0.0, *after])
