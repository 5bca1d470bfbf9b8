"""The window in which the wide generator weighs a gap: that of the contract of the gap report."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.blind.wide.window import USUAL, Window, band_of, of_white_noise

TICK = 1.0 / 4000.0
TIME = np.arange(0.0, 8.0, TICK)


def wave(frequency: float) -> np.ndarray:
    return np.asarray(np.sin(2.0 * np.pi * frequency * TIME))


def window(moving: np.ndarray | None = None) -> Window:
    return Window(USUAL, TICK, (np.ones_like(TIME, dtype=bool) if moving is None else moving)[:, None])


@pytest.mark.parametrize(("frequency", "left"), [(5.0, 1.0), (USUAL, 0.5), (200.0, 0.0)])
def test_a_torque_counts_as_what_a_butterworth_low_pass_leaves_of_it_there_and_back(frequency: float, left: float) -> None:
    middle = window().of(wave(frequency), 0)[len(TIME) // 4 : -len(TIME) // 4]
    np.testing.assert_allclose(middle, left * wave(frequency)[len(TIME) // 4 : -len(TIME) // 4], atol=1e-3)


def test_what_holds_an_axis_at_rest_does_not_count() -> None:
    rests = (TIME > 3.0) & (TIME < 5.0)
    held = np.where(rests, 100.0, wave(2.0))
    np.testing.assert_allclose(window(~rests).of(held, 0), window(~rests).of(np.where(rests, 0.0, held), 0), atol=1e-12)
    assert len(window(~rests).of(held, 0)) == np.count_nonzero(~rests)


@pytest.mark.parametrize(("amplitude", "wide"), [(0.1, False), (0.5, True)])
def test_a_band_goes_as_far_as_the_torque_varies(amplitude: float, wide: bool) -> None:
    """A wave of a tenth has 1 % of the power, one of a half a fifth."""
    band = band_of([wave(2.0) + amplitude * wave(150.0)], TICK, 1000.0)
    assert band == USUAL if not wide else 150.0 < band < 1.2 * 150.0


def test_a_band_ends_where_the_sample_rate_does() -> None:
    assert band_of([wave(2.0) + wave(150.0)], TICK, 100.0) == 40.0


def test_a_band_ends_where_the_values_do() -> None:
    """Of what varies up to 2 kHz, recorded at 5 kHz and weighed at 1 kHz."""
    noise, moving = np.random.default_rng(2).standard_normal(8000), np.ones((8000, 1), dtype=bool)
    weighed = Window(2000.0, 1e-3, moving).of(noise, 0)
    np.testing.assert_array_equal(weighed, Window(400.0, 1e-3, moving).of(noise, 0))


@pytest.mark.parametrize("rate", [200.0, 1000.0, 5000.0])
def test_white_noise_is_left_by_its_bandwidth(rate: float) -> None:
    noise = np.random.default_rng(1).standard_normal(200_000)
    moving = np.ones((len(noise), 1), dtype=bool)
    left = Window(USUAL, 1.0 / rate, moving).of(noise, 0)
    assert np.std(left) == pytest.approx(of_white_noise(USUAL, rate), rel=0.03)
    assert of_white_noise(USUAL, rate) == pytest.approx(np.sqrt(2.0 * USUAL / rate), rel=0.1)
