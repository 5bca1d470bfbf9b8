"""Waves that pass faster than a recording has samples: what of them is in its torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Answer = Callable[[NDArray[np.float64]], NDArray[np.complex128]]
"""Share of a torque that disturbs an axis, by its frequency (n,) [Hz], that the drive's loops give against it."""


@dataclass(frozen=True)
class Sampling:
    """Samples every `period` [s], of a drive whose loops `answer` a torque."""

    period: float
    answer: Answer

    def seen(self, frequency: NDArray[np.float64], period: float) -> NDArray[np.complex128]:
        """Share (n,) of a wave of a frequency (n,) [Hz] that is in the torque, where that is read every `period` [s].

        The acceleration that a wave makes was recorded with it up to half the sample rate, and the two together are the wave.
        Of a faster one the acceleration is lost, and the torque is what the loops give. What has an alias above half the rate
        at which the torque is read was filtered before.
        """
        rate = 1.0 / self.period
        found = np.ones(len(frequency), dtype=np.complex128)
        fast = frequency > 0.5 * rate
        found[fast] = self.answer(frequency[fast])
        alias = np.abs((frequency + 0.5 * rate) % rate - 0.5 * rate)
        found[alias > 0.5 / period] = 0.0
        return found
