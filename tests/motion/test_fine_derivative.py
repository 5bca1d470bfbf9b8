"""The derivative of a motion up to near half its sample rate: of polynomials, whose slope is known, and of sines."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Chebyshev

from drivetwin.motion.filtering import fine_derivative, fine_slope, half_width

PERIOD, HIGHEST = 0.02, 20.0
"""Of a slow log [s], and what it is compared up to [Hz]: over 17 samples."""


@pytest.mark.parametrize("degree", [1, 2, 5, 12, 16])
def test_the_slope_of_a_polynomial_of_degree_sixteen_is_exact(degree: int) -> None:
    curve = Chebyshev.basis(degree, domain=[0.0, 60 * PERIOD])
    time = np.arange(61) * PERIOD
    exact = curve.deriv()(time)
    slope = fine_derivative(curve(time), PERIOD, HIGHEST)
    assert slope[8:-8] == pytest.approx(exact[8:-8], rel=1e-9, abs=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize(("share_of_rate", "passed"), [(0.05, 1.0), (0.2, 1.0), (0.25, 0.9986), (0.3, 0.9864), (0.4, 0.7525)])
def test_of_a_sine_it_gives_the_stated_share(share_of_rate: float, passed: float) -> None:
    angle = 2.0 * np.pi * share_of_rate
    number = np.arange(500)
    slope = fine_derivative(np.sin(angle * number + 0.4), PERIOD, HIGHEST)[20:-20]
    exact = angle / PERIOD * np.cos(angle * number + 0.4)[20:-20]
    assert slope == pytest.approx(passed * exact, abs=1e-4 * angle / PERIOD)
    assert fine_slope(np.array([0.0, angle]), half_width(PERIOD, HIGHEST)) == pytest.approx([1.0, passed], abs=1e-4)


@pytest.mark.parametrize("count", [2, 3, 6, 7, 16, 17, 18])
def test_however_few_samples_there_are_a_line_has_its_slope(count: int) -> None:
    line = np.arange(count, dtype=np.float64) * (3.0 * PERIOD)
    assert fine_derivative(line, PERIOD, HIGHEST) == pytest.approx(np.full(count, 3.0))


def test_near_its_ends_a_motion_that_does_not_begin_at_rest_keeps_its_slope() -> None:
    """From as many samples as there are on both sides: a sine at a fifth of the sample rate, four samples from the end."""
    angle = 2.0 * np.pi * 0.2
    number = np.arange(100)
    slope = fine_derivative(np.sin(angle * number + 0.4), PERIOD, HIGHEST)
    exact = angle / PERIOD * np.cos(angle * number + 0.4)
    assert np.abs(slope - exact)[4:-4].max() < 0.01 * angle / PERIOD


@pytest.mark.parametrize(("cutoff_hz", "half"), [(1.0, 3), (7.0, 3), (11.0, 4), (13.0, 5), (20.0, 8)])
def test_a_derivative_is_made_of_as_few_samples_as_give_most_of_an_acceleration(cutoff_hz: float, half: int) -> None:
    assert half_width(PERIOD, cutoff_hz) == half
    angle = np.array([2.0 * np.pi * cutoff_hz * PERIOD])
    assert bool(fine_slope(angle, half)[0] ** 2 >= 0.95) is (cutoff_hz < 15.0)
