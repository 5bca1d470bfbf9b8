"""The test for a gap, simulated: how often it is wrong about noise, and how soon it sees a gap."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from gap_bench import CUTOFF, axis_of, coloured_noise, recording_of, slowly, time_of
from scipy import stats
from scipy.optimize import brentq

from drivetwin.diagnosis.report.gap_test import NOISE_KNOWN_TO, Errs, GapFound, gap_of, significance
from drivetwin.diagnosis.report.result import Prediction

TRIES = 600


def rejections(rms: float, noise_rms: float, seconds: float, seed: int) -> float:
    """Share of trials in which noise of `rms` is called a gap at the 1 % level, told that noise has `noise_rms`."""
    rng = np.random.default_rng(seed)
    recordings = noisy(rng, rms, seconds)
    return float(np.mean([significance(each, "rotate", Errs(noise_rms), CUTOFF) < 0.01 for each in recordings]))


def told(unseen: list[Prediction], fitted: list[Prediction], errs: Errs) -> GapFound:
    """Of two motions with the same noise."""
    return gap_of(unseen, fitted, "rotate", CUTOFF, errs, errs)


def noisy(rng: np.random.Generator, rms: float, seconds: float) -> Iterator[list[Prediction]]:
    """As many recordings of one motion as there are tries, each with noise of its own."""
    time = time_of(seconds)
    still = axis_of(time, np.zeros_like(time))
    for _ in range(TRIES):
        measured = still.before + coloured_noise(rng, len(time), rms)
        yield [recording_of(time, {"rotate": replace(still, measured=measured, after=measured)})]


def test_noise_as_large_as_the_test_allows_for_is_seldom_called_a_gap() -> None:
    """At the edge of its null hypothesis: about as often as the level says, and no more than twice that."""
    assert 0.0 < rejections((1.0 + NOISE_KNOWN_TO) * 0.05, 0.05, 20.0, seed=1) <= 0.02


def test_few_blocks_raise_no_more_false_alarms() -> None:
    assert rejections((1.0 + NOISE_KNOWN_TO) * 0.05, 0.05, 3.0, seed=2) <= 0.02


def test_a_gap_of_the_noise_s_own_energy_is_seen() -> None:
    assert rejections(np.sqrt(2.0) * 0.05, 0.05, 20.0, seed=3) >= 0.99


def test_a_gap_too_small_for_any_machine_is_none() -> None:
    time = time_of(20.0)
    axis = axis_of(time, np.full_like(time, 1e-6))
    assert significance([recording_of(time, {"rotate": axis})], "rotate", Errs(0.0), CUTOFF) == 1.0


def test_a_short_spell_of_motion_shows_nothing() -> None:
    time = time_of(0.062)
    axis = axis_of(time, np.full_like(time, 1.0))
    assert axis.used.sum() == 2
    assert significance([recording_of(time, {"rotate": axis})], "rotate", Errs(0.1), CUTOFF) <= 1.0


def test_recordings_count_together() -> None:
    rng = np.random.default_rng(4)
    time = time_of(20.0)
    one = recording_of(time, {"rotate": axis_of(time, coloured_noise(rng, len(time), 0.065))})
    two = recording_of(time, {"rotate": axis_of(time, coloured_noise(rng, len(time), 0.065))})
    both = significance([one, two], "rotate", Errs(0.05), CUTOFF)
    assert both < min(significance([one], "rotate", Errs(0.05), CUTOFF), significance([two], "rotate", Errs(0.05), CUTOFF))


def of_noise(rng: np.random.Generator, rms: float, seconds: float = 20.0) -> list[Prediction]:
    """A recording whose gap is noise of `rms`."""
    time = time_of(seconds)
    return [recording_of(time, {"rotate": axis_of(time, coloured_noise(rng, len(time), rms))})]


def test_a_gap_that_has_died_out_is_on_the_fitted_motion_only() -> None:
    rng = np.random.default_rng(6)
    found = told(of_noise(rng, 0.05), of_noise(rng, 0.2), Errs(0.05))
    assert found.p_value < 1e-6
    assert (found.on_unseen, found.on_fitted_only, found.significant) == (False, True, True)


def test_a_gap_on_unseen_motion_is_one_whatever_the_fitted_shows() -> None:
    rng = np.random.default_rng(7)
    for fitted in (0.05, 0.2):
        found = told(of_noise(rng, 0.2), of_noise(rng, fitted), Errs(0.05))
        assert (found.on_unseen, found.on_fitted_only) == (True, False)


def test_what_the_unseen_motion_shows_as_no_gap_is_none_on_the_fitted_motion() -> None:
    """Both are above the told noise, the one hardly and the other not by as much as a noise level is known to."""
    rng = np.random.default_rng(8)
    found = told(of_noise(rng, 0.060), of_noise(rng, 0.068), Errs(0.05))
    assert significance(of_noise(rng, 0.068), "rotate", Errs(0.05), CUTOFF) < 0.01
    assert not found.significant


@pytest.mark.parametrize(("unseen", "fitted"), [(0.098, 0.18), (0.02, 0.18), (0.18, 0.02), (0.18, 0.18)])
def test_a_gap_that_exceeds_what_a_model_is_expected_to_miss_exceeds_its_misfit(unseen: float, fitted: float) -> None:
    """Noise 0.01, misfit 0.1, model error 0.12. On either motion, or on the fitted one only."""
    rng = np.random.default_rng(10)
    seen = of_noise(rng, unseen), of_noise(rng, fitted)
    expected = told(*seen, Errs(float(np.hypot(0.01, 0.12))))
    found = told(*seen, Errs(0.01, 0.1))
    assert expected.significant
    assert (found.significant, found.on_unseen) == (True, expected.on_unseen)


@pytest.mark.parametrize(("gap", "significant"), [(0.095, False), (0.11, True)])
def test_a_misfit_is_what_it_is_said_to_be(gap: float, significant: bool) -> None:
    """Noise is taken 25 % larger, the misfit is not."""
    rng = np.random.default_rng(11)
    found = told(of_noise(rng, gap), of_noise(rng, gap), Errs(0.01, 0.1))
    assert found.significant is significant


@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_noise_of_the_unseen_motion_hides_no_gap_of_the_fitted_one(gap: float) -> None:
    """That of the unseen motion is four times as large as the gap."""
    rng = np.random.default_rng(12)
    unseen, fitted = of_noise(rng, 0.4), of_noise(rng, float(np.hypot(0.05, gap)))
    found = gap_of(unseen, fitted, "rotate", CUTOFF, Errs(0.4), Errs(0.05))
    assert (found.on_unseen, found.on_fitted_only) == (False, gap > 0.0)


def test_two_looks_call_noise_a_gap_no_more_often_than_one() -> None:
    rng = np.random.default_rng(9)
    edge = (1.0 + NOISE_KNOWN_TO) * 0.05
    tries = zip(noisy(rng, edge, 3.0), noisy(rng, edge, 3.0), strict=True)
    assert np.mean([told(unseen, fitted, Errs(0.05)).significant for unseen, fitted in tries]) <= 0.02


def test_the_lesser_p_value_counts_twice() -> None:
    """Noise told so that one look at the unseen motion says 0.7 %, and the fitted motion nothing."""
    rng = np.random.default_rng(10)
    unseen, fitted = of_noise(rng, 0.065), of_noise(rng, 0.03)
    level = brentq(lambda noise: significance(unseen, "rotate", Errs(noise), CUTOFF) - 0.007, 0.03, 0.065)
    found = told(unseen, fitted, Errs(level))
    assert found.p_value == pytest.approx(0.014, rel=1e-3)
    assert not found.significant


def test_a_slow_recording_has_as_many_independent_values_as_its_own_cut_off_lets_through() -> None:
    """At 10 Hz no more than 4 Hz pass: the closed form with 2 B T at that cut-off."""
    time = time_of(60.0)
    gap = 0.07 * np.where(np.floor(time / 0.1) % 2, 1.0, -1.0)
    recording = slowly(recording_of(time, {"rotate": axis_of(time, gap)}), 100)
    moving = float(recording.axes["rotate"].used.sum()) * 0.1
    degrees = 2.0 * 0.4 * 10.0 * moving
    level = (1.0 + NOISE_KNOWN_TO) * 0.05
    told = significance([recording], "rotate", Errs(0.05), CUTOFF)
    assert told == pytest.approx(stats.chi2.sf(degrees * 0.07**2 / level**2, degrees), rel=1e-6)
