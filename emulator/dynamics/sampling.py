"""Waves that pass faster than a recording has the acceleration: what of them is in its torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.cached import cached_property
from drivetwin.motion.filtering import fine_slope, half_width

Answer = Callable[[NDArray[np.float64]], NDArray[np.complex128]]
"""Share of a torque that disturbs an axis, by its frequency (n,) [Hz], that the drive's loops give against it."""
MOST = 3.0
"""Times a disturbance that a drive gives against it at most: loops that give more would ring."""

KNOWN = 0.999
"""Share of an acceleration from which it is known."""
STEPS, FARTHEST = 4000, 10.0
"""Frequencies between which that share is interpolated, which then errs by less than 1e-5; up to so many times the motion's
cut-off: above it hardly anything passes."""


@dataclass(frozen=True)
class Sampling:
    """Samples every `period` [s], of a drive whose loops `answer` a torque on an `inertia` [kg·m² or kg]; the motion is
    filtered at `motion_hz`.

    `late` [s]: by which the torque was recorded late, and is read earlier between samples.
    """

    period: float
    answer: Answer
    motion_hz: float
    inertia: float
    late: float = 0.0

    def seen(self, frequency: NDArray[np.float64], period: float) -> NDArray[np.complex128]:
        """Share (n,) of a wave of a frequency (n,) [Hz] that is in the torque beside the known acceleration, where the torque
        is read every `period` [s]; quasi-steady in speed.

        The loops give T of the wave, and it accelerates the axis with 1 - T of it. As far as that acceleration is known, the
        two together are the wave. Above half the sample rate the samples have an alias, whose acceleration is as much smaller
        as the square of its frequency. To read an alias earlier turns it by its own frequency, and not by the wave's. What has
        an alias above half the rate at which the torque is read was filtered before.
        """
        alias, known = self._alias(frequency), self.known(frequency)
        found = np.ones(len(frequency), dtype=np.complex128)
        partly = known < KNOWN
        given = self.answer(frequency[partly])
        found[partly] = given + (1.0 - given) * known[partly]
        found *= self.turned(frequency)
        found[np.abs(alias) > 0.5 / period] = 0.0
        return found

    def of_a_late_encoder(self, delay: float) -> Sampling:
        """The same of a drive that reads its encoder `delay` [s] late, C e^(-s delay) in place of C, for a torque that is read
        as much later between samples.
        """
        return replace(self, answer=lambda frequency: _later(self.answer(frequency), frequency, delay), late=self.late - delay)

    def unseen(self, frequency: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        """Share (n,) of an acceleration of a frequency (n,) [Hz] that the recorded motion does not show; 0 of what has an alias
        that is not in the torque either. `period` as of `seen`.
        """
        known = self.known(frequency)
        there = (known < KNOWN) & (np.abs(self._alias(frequency)) <= 0.5 / period)
        return np.where(there, 1.0 - known, 0.0)

    def turned(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """By what (n,) the alias of a wave of a frequency (n,) [Hz] is turned as the torque is read earlier between samples."""
        return np.asarray(np.exp(-2j * np.pi * (frequency - self._alias(frequency)) * self.late))

    def known(self, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        """Share (n,) of an acceleration of a frequency (n,) [Hz] that the recorded motion shows: what of its alias passes the
        filter and two slopes (`motion/filtering.py`); all from `KNOWN` on.
        """
        alias = self._alias(frequency)
        slower = np.divide(alias, frequency, out=np.ones_like(alias), where=frequency > 0.0)
        share = np.interp(np.abs(alias), *_shown(self.period, self.motion_hz)) * slower**2
        return np.where(share < KNOWN, share, 1.0)

    @cached_property
    def known_to(self) -> float:
        """Frequency [Hz] up to which the motion shows all of an acceleration."""
        frequency, shown = _shown(self.period, self.motion_hz)
        return float(frequency[np.argmax(shown < KNOWN) - 1])

    def _alias(self, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        rate = 1.0 / self.period
        return (frequency + 0.5 * rate) % rate - 0.5 * rate

    @property
    def is_likely(self) -> bool:
        """Whether loops of a drive may be so: none of them rings."""
        share = np.abs(self.answer(np.geomspace(0.01, 1.0, 200) / self.period))
        return bool(np.isfinite(share).all() and share.max() < MOST)


@lru_cache(maxsize=64)
def _shown(period: float, motion_hz: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies [Hz], and the share of an acceleration there that filter and slopes pass; (k,) each."""
    corner = min(motion_hz * period, 0.499)
    angle = np.linspace(0.0, np.pi * min(0.5, FARTHEST * corner), STEPS)
    passes = 1.0 / (1.0 + (np.tan(angle) / np.tan(np.pi * corner)) ** 8)
    return angle / (np.pi * period), passes * fine_slope(2.0 * angle, half_width(period, motion_hz)) ** 2


def _later(given: NDArray[np.complex128], frequency: NDArray[np.float64], delay: float) -> NDArray[np.complex128]:
    """T = C / (J s² + C) with C e^(-s delay) in place of C, by T."""
    late = given * np.exp(-2j * np.pi * frequency * delay)
    return np.asarray(late / (1.0 - given + late))
