"""The test for a gap, simulated: how often it is wrong about noise, and how soon it sees a gap."""

from __future__ import annotations

import numpy as np
from gap_bench import CUTOFF, axis_of, coloured_noise, recording_of, time_of

from diagnosis.gap_test import NOISE_KNOWN_TO, significance

TRIES = 600


def rejections(rms: float, noise_rms: float, seconds: float, seed: int) -> float:
    """Share of trials in which noise of `rms` is called a gap at the 1 % level, told that noise has `noise_rms`."""
    rng = np.random.default_rng(seed)
    time = time_of(seconds)
    gaps = (coloured_noise(rng, len(time), rms) for _ in range(TRIES))
    recordings = ([recording_of(time, {"rotate": axis_of(time, gap)})] for gap in gaps)
    return float(np.mean([significance(each, "rotate", noise_rms, CUTOFF) < 0.01 for each in recordings]))


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
    assert significance([recording_of(time, {"rotate": axis})], "rotate", 0.0, CUTOFF) == 1.0


def test_a_short_spell_of_motion_shows_nothing() -> None:
    time = time_of(0.062)
    axis = axis_of(time, np.full_like(time, 1.0))
    assert axis.used.sum() == 2
    assert significance([recording_of(time, {"rotate": axis})], "rotate", 0.1, CUTOFF) <= 1.0


def test_recordings_count_together() -> None:
    rng = np.random.default_rng(4)
    time = time_of(20.0)
    one = recording_of(time, {"rotate": axis_of(time, coloured_noise(rng, len(time), 0.065))})
    two = recording_of(time, {"rotate": axis_of(time, coloured_noise(rng, len(time), 0.065))})
    both = significance([one, two], "rotate", 0.05, CUTOFF)
    assert both < min(significance([one], "rotate", 0.05, CUTOFF), significance([two], "rotate", 0.05, CUTOFF))
