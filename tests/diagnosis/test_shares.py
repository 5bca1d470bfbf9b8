"""How a gap's energy is divided up: parts that do not overlap have their own energy, and all of it adds up to 1."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.diagnosis.report.result import Array, Share
from drivetwin.diagnosis.report.shares import shares

PERIOD = 0.01
TIME = np.arange(6000) * PERIOD
"""A whole minute: sines of whole frequencies are orthogonal over it."""


def sine(amplitude: float, frequency: float) -> Array:
    """Of mean square amplitude² / 2."""
    return np.asarray(amplitude * np.sin(2.0 * np.pi * frequency * TIME))


def divided(gap: Array, parts: dict[str, Array], noise: float = 0.0, seed: int = 0) -> dict[str, Share]:
    found = shares([gap], [[part] for part in parts.values()], list(parts), [PERIOD], noise, seed)
    assert [one.of for one in found] == [*parts, "unknown", "noise"]
    return {one.of: one for one in found}


def test_orthogonal_parts_have_the_share_of_their_own_energy() -> None:
    parts = {"spring": sine(3.0, 1.0), "stribeck": sine(2.0, 2.0)}
    white = np.random.default_rng(0).standard_normal(len(TIME))
    white -= sum(part * (part @ white) / (part @ part) for part in parts.values())
    white *= 0.5 / np.sqrt(np.mean(white**2))
    found = divided(parts["spring"] + parts["stribeck"] + sine(1.0, 5.0) + white, parts, noise=0.5)
    energy = 4.5 + 2.0 + 0.5 + 0.25
    left = {"spring": 4.5, "stribeck": 2.0, "unknown": 0.5, "noise": 0.25}
    assert {name: one.share for name, one in found.items()} == pytest.approx(
        {name: part / energy for name, part in left.items()}, abs=0.01
    )
    for one in found.values():
        assert one.ci90[0] <= one.share <= one.ci90[1]


def test_an_effect_in_the_opposite_sense_takes_nothing() -> None:
    found = divided(sine(1.0, 1.0), {"spring": -sine(1.0, 1.0)})
    assert (found["spring"].share, found["unknown"].share) == (0.0, 1.0)


def test_effects_that_overlap_share_what_is_gone_and_what_is_too_much_is_unknown() -> None:
    """0.8 and 0.6 of the gap leave -0.4 of it: 0.16 of its energy, of which 0.02 is noise."""
    gap = sine(1.0, 1.0)
    found = divided(gap, {"coulomb": 0.8 * gap, "stribeck": 0.6 * gap}, noise=0.1)
    assert found["coulomb"].share == pytest.approx(0.84 * 0.8 / 1.4)
    assert found["stribeck"].share == pytest.approx(0.84 * 0.6 / 1.4)
    assert found["unknown"].share == pytest.approx(0.14)
    assert found["noise"].share == pytest.approx(0.02)


def test_two_effects_that_undo_each_other_have_no_share_of_what_a_third_takes() -> None:
    """Before, the one of the two that goes with the gap had most of it: nine tenths."""
    gap, other = sine(1.0, 1.0), sine(1.0, 2.0)
    parts = {"spring": 3.0 * other + 0.6 * gap, "gravity": -3.0 * other - 0.5 * gap, "encoder_eccentricity": 0.9 * gap}
    found = divided(gap, parts)
    assert found["spring"].share == pytest.approx(0.1, abs=0.05)
    assert found["gravity"].share == 0.0
    assert found["encoder_eccentricity"].share == pytest.approx(0.9, abs=0.05)


@given(st.lists(st.integers(-5, 5), min_size=3, max_size=3), st.lists(st.floats(0.1, 1.0), min_size=3, max_size=3))
def test_shares_are_averages_over_all_orders(phases: list[int], sizes: list[float]) -> None:
    """What each of three effects takes when it is added, over all six orders, where none is below 0."""
    parts = [size * np.sin(2.0 * np.pi * TIME + 0.1 * phase) for size, phase in zip(sizes, phases, strict=True)]
    gap = np.asarray(sum(parts))
    taken = np.zeros(3)
    for order in itertools.permutations(range(3)):
        left = gap.copy()
        for k in order:
            taken[k] += (left @ left - (left - parts[k]) @ (left - parts[k])) / (6.0 * (gap @ gap))
            left = left - parts[k]
    found = divided(gap, {str(k): part for k, part in enumerate(parts)})
    assert (taken > 0.0).all()
    assert [found[str(k)].share for k in range(3)] == pytest.approx(list(taken), abs=1e-6)


def test_a_gap_no_larger_than_noise_is_noise() -> None:
    found = divided(sine(1.0, 1.0), {"spring": sine(0.5, 2.0)}, noise=2.0)
    assert found["noise"].share == 1.0


def test_recordings_weigh_by_their_time_and_not_by_their_samples() -> None:
    """One of them at a tenth of the rate."""
    fine, coarse = sine(1.0, 1.0), sine(2.0, 1.0)[::10]
    found = shares([fine, coarse], [[fine, 0.0 * coarse]], ["spring"], [PERIOD, 10.0 * PERIOD], 0.0, 0)
    assert found[0].share == pytest.approx(1.0 / (1.0 + 4.0), rel=0.01)


def test_where_nothing_is_used_nothing_is_divided() -> None:
    assert shares([], [], [], [], 0.1, 0) == ()
    assert shares([np.zeros(0)], [], [], [PERIOD], 0.1, 0) == ()
    assert shares([np.zeros(100)], [], [], [PERIOD], 0.1, 0) == ()


def test_a_seed_gives_the_same_intervals() -> None:
    gap = sine(1.0, 1.0) * np.exp(-TIME / 20.0)
    parts = {"spring": 0.7 * sine(1.0, 1.0)}
    assert divided(gap, parts, 0.1, seed=3) == divided(gap, parts, 0.1, seed=3)
    assert divided(gap, parts, 0.1, seed=3)["spring"].ci90 != divided(gap, parts, 0.1, seed=4)["spring"].ci90


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 4), noise=st.floats(0.0, 3.0), scale=st.floats(1e-3, 1e3))
def test_they_are_never_negative_and_add_up_to_one(seed: int, count: int, noise: float, scale: float) -> None:
    rng = np.random.default_rng(seed)
    gap = scale * rng.standard_normal(900)
    parts = {str(k): scale * rng.uniform(-1.0, 2.0) * (gap / scale + rng.standard_normal(900)) for k in range(count)}
    found = divided(gap, parts, noise * scale, seed % 7)
    assert math.fsum(one.share for one in found.values()) == pytest.approx(1.0, abs=1e-12)
    for one in found.values():
        assert 0.0 <= one.ci90[0] <= one.share <= one.ci90[1] <= 1.0
