"""The density of a position's noise beside a trend: the closed form of white noise."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.motion.spectrum import density


@pytest.mark.parametrize("times", [2, 4])
def test_white_noise_beside_a_trend_has_the_density_of_white_noise(times: int) -> None:
    """2 sigma^2 T at every frequency, one-sided, although the trend is a million times as large."""
    period, sigma = 1e-3, 2e-6
    noise = sigma * np.random.default_rng(0).standard_normal(100_000)
    frequency, found = density(noise + np.linspace(0.0, 2.0, len(noise)), period, times, 512)
    within = (frequency > 100.0) & (frequency < 480.0)
    assert np.mean(found[within]) == pytest.approx(2.0 * sigma**2 * period, rel=0.03)
