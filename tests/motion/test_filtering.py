"""The zero-phase filter is the one of SciPy, sample by sample, and does not shift in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from drivetwin.motion.filtering import reach, zero_phase


@pytest.mark.parametrize("count", [1, 2, 7, 300, 20_000])
@pytest.mark.parametrize(("period", "cutoff"), [(0.001, 48.0), (0.001, 120.0), (0.00025, 48.0), (0.01, 40.0)])
def test_it_is_scipys_filter_forward_and_backward(count: int, period: float, cutoff: float) -> None:
    columns = np.random.default_rng(count).standard_normal((count, 2)).cumsum(axis=0)
    sections = signal.butter(4, cutoff, fs=1.0 / period, output="sos")
    for samples in columns.T:  # every other number in memory
        expected = signal.sosfiltfilt(sections, samples, padlen=min(3 * reach(period, cutoff), count - 1))
        np.testing.assert_allclose(zero_phase(samples, period, cutoff), expected, rtol=0.0, atol=1e-11 * np.abs(samples).max())


def test_what_is_filtered_stays_as_it_was() -> None:
    samples = np.random.default_rng(0).standard_normal(500)
    before = samples.copy()
    zero_phase(samples, 0.001, 48.0)
    np.testing.assert_array_equal(samples, before)
