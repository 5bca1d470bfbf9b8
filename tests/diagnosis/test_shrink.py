"""How far a gap shrinks: sums that are known, an interval that holds what it is about, and the next recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_bench import PERIOD, STANDSTILL, axis_of, coloured_noise, recording_of, time_of

from drivetwin.diagnosis.report.result import TWO_SIDED_90, Array, Prediction, Shrink
from drivetwin.diagnosis.report.shrink import BETWEEN_MOTIONS, shrink

TIME = time_of(40.0)
ONES = np.ones(len(TIME))


def left(gap: Array) -> list[Prediction]:
    """Of one recording, what `after` leaves."""
    time = np.arange(len(gap), dtype=np.float64) * PERIOD
    return [recording_of(time, {"rotate": axis_of(time, gap, after=gap)})]


def shrunk(before: Array, after: Array, noise: float = 0.0, seed: int = 0) -> Shrink:
    found = shrink(left(before), left(after), "rotate", noise, seed)
    assert found is not None
    return found


def test_known_levels_give_the_known_share() -> None:
    assert shrunk(2.0 * ONES, 0.5 * ONES).validation == pytest.approx(1.0 - 0.25**2)


def test_noise_is_taken_off_both() -> None:
    found = shrunk(2.0 * ONES, 0.5 * ONES, noise=0.3)
    assert found.of_explainable == pytest.approx(1.0 - (0.25 - 0.09) / (4.0 - 0.09))


def test_all_that_can_be_explained_is_one_and_no_more() -> None:
    assert shrunk(2.0 * ONES, 0.29 * ONES, noise=0.3).of_explainable == 1.0


def test_of_a_gap_no_larger_than_the_noise_there_is_nothing_to_explain() -> None:
    assert shrunk(0.2 * ONES, 0.1 * ONES, noise=0.3).of_explainable is None
    assert shrunk(0.2 * ONES, 0.5 * ONES, noise=0.3).of_explainable is None


def test_an_effect_that_misleads_closes_less_than_nothing() -> None:
    assert shrunk(ONES, 1.5 * ONES).validation == pytest.approx(1.0 - 1.5**2)


def test_only_samples_in_use_count() -> None:
    used = axis_of(TIME, ONES).used
    wild = np.where(used, 0.5, 1e3)
    assert not used.all()
    assert shrunk(2.0 * ONES, wild).validation == pytest.approx(1.0 - 0.25**2)


def test_recordings_count_by_their_energy() -> None:
    before, after = [*left(2.0 * ONES), *left(4.0 * ONES)], [*left(1.0 * ONES), *left(0.0 * ONES)]
    found = shrink(before, after, "rotate", 0.0, 0)
    assert found is not None
    assert found.validation == pytest.approx(1.0 - 1.0 / (4.0 + 16.0))


def test_the_interval_holds_its_value_and_is_wider_where_blocks_differ() -> None:
    rng = np.random.default_rng(2)
    uneven = np.repeat(np.exp(rng.standard_normal(40)), len(TIME) // 40)
    even, spread = shrunk(2.0 * ONES, 0.5 * ONES), shrunk(2.0 * ONES, 0.5 * uneven)
    for found in (even, spread):
        assert found.ci90[0] < found.validation < found.ci90[1] <= 1.0
    assert _width(spread) > 1.2 * _width(even)


def test_the_interval_holds_what_another_recording_of_the_kind_shows() -> None:
    """Blocks whose level is drawn anew: nine in ten of 100 pairs."""
    held = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        one, other = (shrunk(ONES, 0.3 * np.repeat(np.exp(rng.standard_normal(40)), len(TIME) // 40)) for _ in range(2))
        held += one.ci90[0] <= other.validation <= one.ci90[1]
    assert held >= 90


def test_the_interval_goes_no_further_than_blocks_and_other_motion_do() -> None:
    """Nearly all that is left is in one second of five, where the effect closes 0.19: no draw leaves more."""
    time = time_of(5.0)
    after = np.where(time < 1.0, 0.9, 0.03)
    found = shrunk(np.ones(len(time)), after)
    between = np.exp(TWO_SIDED_90 * BETWEEN_MOTIONS)
    assert found.ci90[0] == pytest.approx(1.0 - 0.9**2 * between)
    assert found.ci90[1] == pytest.approx(1.0 - 0.03**2 / between)


def test_the_interval_is_the_same_for_the_same_seed() -> None:
    after = coloured_noise(np.random.default_rng(0), len(TIME), 0.3)
    assert shrunk(ONES, after, seed=4) == shrunk(ONES, after, seed=4)
    assert shrunk(ONES, after, seed=4).ci90 != shrunk(ONES, after, seed=5).ci90


def test_an_axis_without_gap_or_motion_has_no_shrink() -> None:
    assert shrink(left(0.0 * ONES), left(0.0 * ONES), "rotate", 0.1, 0) is None
    still = [_still(each) for each in left(ONES)]
    assert shrink(still, still, "rotate", 0.1, 0) is None


def _still(prediction: Prediction) -> Prediction:
    axis = prediction.axes["rotate"]
    unmoved = replace(axis, velocity=0.0 * axis.velocity, used=np.abs(0.0 * axis.velocity) > STANDSTILL)
    return replace(prediction, axes={"rotate": unmoved})


def _width(found: Shrink) -> float:
    """Of the interval, on the logarithm of what is left."""
    return float(np.log((1.0 - found.ci90[0]) / (1.0 - found.ci90[1])))


def test_a_drives_effect_closes_what_the_drive_withheld_and_not_what_an_effect_before_it_costs() -> None:
    """That costs 3; the drive gave 1 less than its law asks for; 0.2 is what nothing explains."""
    own = axis_of(TIME, 3.2 * ONES, after=0.2 * ONES)
    before, later = (
        [recording_of(TIME, {"rotate": replace(own, before=own.before + withheld)})] for withheld in (0.0, 1.0)
    )
    found = shrink(before, later, "rotate", 0.0, 0)
    assert found is not None
    assert found.validation == pytest.approx(1.0 - 0.2**2 / (3.2 - 3.0 - 1.0) ** 2)
