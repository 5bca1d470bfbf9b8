"""The colour of the noise: Yule-Walker as scipy solves it, and autoregressions of a known law that come out white."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter
from scipy.stats import multivariate_normal
from scipy.stats import t as student
from weigh_bench import PERIOD, autoregressive, rows_of

from drivetwin.diagnosis.model.colour import SHRUNK, Colour, colour_of, white
from drivetwin.diagnosis.report.result import Array

ORDER = 6
LAW = (1.6, -0.9, 0.2)
"""Of a process that swings: its poles are within the unit circle."""


def coloured(residual: Array, stretches: tuple[int, ...], floor: float = 0.0, order: int = ORDER) -> Colour:
    return colour_of(rows_of(stretches), np.array([[PERIOD, PERIOD]]), residual, order, floor)


def _plain(count: int) -> tuple[Array, Array, Array]:
    """Weights, excess and counts of rows of normal noise that each count as one."""
    return np.ones(count), np.zeros(count), np.ones(count)


def _density(colour: Colour, rows: Array) -> float:
    """Log density of rows (N,)."""
    return -0.5 * float(np.sum(colour.whiten(rows) ** 2)) - colour.logarithm - 0.5 * len(rows) * float(np.log(2.0 * np.pi))


def products(residual: Array, order: int) -> Array:
    """Products of a contiguous residual with itself, 0 to `order` rows later, over the number of rows: never indefinite."""
    return np.array([np.sum(residual[lag:] * residual[: len(residual) - lag]) for lag in range(order + 1)]) / len(residual)


@pytest.mark.parametrize("floor", [0.0, 0.7])
def test_predictors_of_every_order_solve_yule_and_walkers_equations(floor: float) -> None:
    residual = autoregressive(np.random.default_rng(0), 3000, LAW, 0.5)
    found = coloured(residual, (3000,), floor)
    told = products(residual, ORDER)
    told[0] = (1.0 + SHRUNK) * told[0] + floor**2
    for order in range(1, ORDER + 1):
        expected = solve_toeplitz(told[:order], told[1 : order + 1])
        np.testing.assert_allclose(found.predictors[0][order], expected, rtol=1e-8, atol=1e-12)
        error = told[0] - expected @ told[1 : order + 1]
        assert (found.deviation[0][order] * found.scale[0]) ** 2 == pytest.approx(error, rel=1e-8)


def test_a_known_autoregression_is_found_again() -> None:
    residual = autoregressive(np.random.default_rng(1), 60_000, LAW, 0.5)
    found = coloured(residual, (60_000,))
    np.testing.assert_allclose(found.predictors[0][ORDER][:3], LAW, atol=0.03)
    assert found.scale[0] == pytest.approx(0.5, rel=0.02)


def test_whitened_rows_are_white_and_of_unit_variance() -> None:
    residual = autoregressive(np.random.default_rng(2), 40_000, LAW, 0.5)
    rows = coloured(residual, (40_000,)).whiten(residual)
    assert np.std(rows) == pytest.approx(1.0, rel=0.01)
    likeness = products(rows, 20)[1:] / products(rows, 0)
    assert np.abs(likeness).max() < 4.0 / np.sqrt(len(rows))


def test_behind_a_gap_a_row_is_predicted_from_none_before_it() -> None:
    """Every stretch is whitened as if it were alone."""
    rng = np.random.default_rng(3)
    parts = [autoregressive(rng, count, LAW, 0.5) for count in (2000, 3, 900)]
    whole = np.concatenate(parts)
    found = coloured(whole, (2000, 3, 900))
    rows = np.split(found.whiten(whole), [2000, 2003])
    for part, own in zip(parts, rows, strict=True):
        age = np.minimum(np.arange(len(part)), ORDER)
        alone = Colour((np.arange(len(part)),), found.predictors, found.deviation, found.scale, age, *_plain(len(part)))
        np.testing.assert_allclose(own, alone.whiten(part), atol=1e-12)


def test_products_across_a_gap_are_not_counted() -> None:
    """A residual that turns its sign in every gap of four rows is otherwise one of order 1."""
    rng = np.random.default_rng(4)
    parts = [autoregressive(rng, 400, (0.9,), 1.0) * (-1.0) ** k for k in range(60)]
    found = coloured(np.concatenate(parts), (400,) * 60, order=2)
    assert found.predictors[0][1][0] == pytest.approx(0.9, abs=0.02)


def test_the_density_of_whitened_rows_is_that_of_the_dense_gaussian() -> None:
    """Of a process of first order, whose covariance is known: 0.8^|i - j| / (1 - 0.8²)."""
    count, long = 30, 200_000
    rng = np.random.default_rng(5)
    found = coloured(autoregressive(rng, long, (0.8,), 1.0), (long,), order=1)
    coefficient, variance = float(found.predictors[0][1][0]), found.scale[0] ** 2
    lags = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    covariance = variance / (1.0 - coefficient**2) * coefficient**lags
    age = np.minimum(np.arange(count), 1)
    few = Colour((np.arange(count),), found.predictors, found.deviation, found.scale, age, *_plain(count))
    sample = autoregressive(rng, count, (0.8,), 1.0)
    assert _density(few, sample) == pytest.approx(multivariate_normal(np.zeros(count), covariance).logpdf(sample), abs=1e-3)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.8])
def test_as_many_rows_are_independent_as_tell_a_mean_as_well(memory: float) -> None:
    """Of a process of first order a share (1 - a) / (1 + a); its mean over stretches varies as much."""
    rng = np.random.default_rng(8)
    residual = autoregressive(rng, 400_000, (memory,), 1.0)
    found = coloured(residual, (400_000,), order=1)
    assert found.independent == pytest.approx(400_000 * (1.0 - memory) / (1.0 + memory), rel=0.03)
    means = residual.reshape(2000, 200).mean(axis=1)
    assert np.var(residual) / np.var(means) == pytest.approx(found.independent / 2000, rel=0.1)


def test_each_interval_of_time_has_a_colour_of_its_own() -> None:
    """A recording at another rate: one is white noise of 2, the other swings."""
    rng = np.random.default_rng(6)
    parts = [2.0 * rng.standard_normal(20_000), autoregressive(rng, 20_000, LAW, 0.5)]
    rows = rows_of((20_000, 20_000), runs=(0, 1))
    found = colour_of(rows, np.array([[0.02, 0.02], [PERIOD, PERIOD]]), np.concatenate(parts), ORDER, 0.0)
    own = {float(np.round(scale, 1)): table[ORDER] for scale, table in zip(found.scale, found.predictors, strict=True)}
    assert set(own) == {2.0, 0.5}
    assert np.abs(own[2.0]).max() < 0.03
    np.testing.assert_allclose(own[0.5][:3], LAW, atol=0.05)
    for part in np.split(found.whiten(np.concatenate(parts)), 2):
        assert np.std(part) == pytest.approx(1.0, rel=0.02)


def test_without_colour_rows_are_divided_by_their_level() -> None:
    rows = rows_of((50, 20))
    columns = np.random.default_rng(7).standard_normal((70, 3))
    found = white(rows, np.array([[PERIOD, PERIOD]]), 2.5, ORDER)
    np.testing.assert_allclose(found.whiten(columns), columns / 2.5)
    assert found.logarithm == pytest.approx(70.0 * np.log(2.5))


def test_nothing_left_has_the_floor_as_its_noise() -> None:
    found = coloured(np.zeros(500), (500,), floor=0.3)
    assert found.scale[0] == pytest.approx(0.3)
    np.testing.assert_allclose(found.predictors[0][ORDER], np.zeros(ORDER))


@pytest.mark.parametrize("freedom", [3.0, 6.0])
def test_rows_of_long_tails_have_the_weights_of_their_t_distribution(freedom: float) -> None:
    """White noise of a known t distribution: (freedom + 1) / (freedom + (e / scale)²), Lange, Little and Taylor 1989, eq. 4."""
    residual = 0.5 * np.random.default_rng(9).standard_t(freedom, 40_000)
    found = coloured(residual, (40_000,), order=1)
    told = found.weight**2 * (freedom + (residual / 0.5) ** 2) / (freedom + 1.0)
    assert np.quantile(np.abs(told - 1.0), 0.99) < 0.08


@pytest.mark.parametrize("law", [(), (0.9,), (1.6, -0.7)], ids=["white", "slow", "swinging"])
@pytest.mark.parametrize("freedom", [3.0, 6.0])
def test_the_density_of_weighted_rows_touches_that_of_their_t_distribution_from_below(
    freedom: float, law: tuple[float, ...]
) -> None:
    """At the rows that the weights were found from it is that of scipy's of the innovations; of other rows it is less."""
    rng, count = np.random.default_rng(12), 40_000
    innovations = 0.5 * rng.standard_t(freedom, (2, count))
    one, other = (lfilter([1.0], [1.0, *(-each for each in law)], rows) for rows in innovations)
    found = coloured(one, (count,))
    assert _density(found, one) == pytest.approx(_of_student(_innovations(found, one), freedom, found), abs=1e-2 * count)
    for rows in (0.5 * one, 1.3 * one, 2.0 * one, other):
        assert _density(found, rows) <= _of_student(_innovations(found, rows), freedom, found) + 1e-2 * count


@pytest.mark.parametrize("scale", [1e-2, 1e-4])
def test_long_tails_below_what_any_comparison_errs_by_are_no_denser_than_normal_noise(scale: float) -> None:
    rng, count = np.random.default_rng(13), 20_000
    normal, long = scale * rng.standard_normal(count), scale * rng.standard_t(3.0, count)
    densities = [_density(coloured(rows, (count,), floor=1.0, order=1), rows) for rows in (normal, long)]
    assert densities[1] <= densities[0] + 0.01 * count


@pytest.mark.parametrize("size", [0.0, 1e-170])
def test_rows_whose_squares_are_none_are_normal_noise_at_the_floor(size: float) -> None:
    found = coloured(np.full(50, size), (50,), floor=1e-3, order=1)
    np.testing.assert_array_equal(found.weight, 1.0)
    assert np.isfinite(found.logarithm)


def _innovations(colour: Colour, rows: Array) -> Array:
    """Of rows (N,) of one group, without weights and not divided by any scale."""
    return colour.normal.whiten(rows) * colour.scale[0]


def _of_student(innovations: Array, freedom: float, colour: Colour) -> float:
    """Scipy's log density of innovations at the scale of the colour, the first few of which are divided by their deviation."""
    divided = float(np.log(colour.deviation[0][colour.age]).sum())
    return float(student.logpdf(innovations, freedom, 0.0, colour.scale[0]).sum()) - divided


def test_a_mean_is_told_as_well_as_the_t_distribution_allows() -> None:
    """Of noise with 3 degrees of freedom, twice as well as by the mean of the rows: Fisher's information, 4/6 against 1/3."""
    rng, errors = np.random.default_rng(10), []
    for _ in range(60):
        residual = rng.standard_t(3.0, 2000)
        found = coloured(residual, (2000,), order=1)
        one, rows = found.whiten(np.ones(2000)), found.whiten(residual)
        errors.append((float(one @ rows / (one @ one)), float(residual.mean())))
    weighed, plain = np.std(errors, axis=0)
    assert (weighed / plain) ** 2 < 0.75


def test_normal_noise_has_no_weights() -> None:
    assert (coloured(np.random.default_rng(11).standard_normal(20_000), (20_000,)).weight == 1.0).all()


def test_a_plateau_of_coarse_steps_counts_as_one_row() -> None:
    """Where the steps make all that is left; where they make half of it, as Kish's design effect has it."""
    count, length = 6000, 10
    levels = np.repeat(np.random.default_rng(7).normal(size=count // length), length)
    rows = replace(rows_of((count,)), repeats=np.full(count, float(length)), coarse=np.full(count, float(np.mean(levels**2))))
    assert colour_of(rows, np.array([[PERIOD, PERIOD]]), levels, ORDER, 0.0).counts.sum() == pytest.approx(count / length)
    twice = colour_of(rows, np.array([[PERIOD, PERIOD]]), np.sqrt(2.0) * levels, ORDER, 0.0)
    assert twice.counts.sum() == pytest.approx(count / (1.0 + 0.5 * (length - 1)))


def test_rows_that_count_less_leave_the_level_of_the_noise_as_it_is() -> None:
    residual = np.random.default_rng(8).normal(size=40_000)
    repeats = np.where(np.arange(len(residual)) % 2 == 0, 1.0, 50.0)
    rows = replace(rows_of((len(residual),)), repeats=repeats, coarse=np.full(len(residual), 10.0))
    assert colour_of(rows, np.array([[PERIOD, PERIOD]]), residual, ORDER, 0.0).scale[0] == pytest.approx(1.0, rel=0.02)


def test_recordings_of_one_rate_whose_rows_stand_at_other_intervals_have_a_colour_each() -> None:
    """Sample periods of 2.772 and 2.786 ms: every third sample of one is compared, and every second of the other."""
    rows = rows_of((40, 60), (0, 1))
    found = white(rows, np.array([[0.002772, 3 * 0.002772], [0.002786, 2 * 0.002786]]), 1.0, ORDER)
    assert sorted(len(group) for group in found.groups) == [40, 60]
    assert len(white(rows, np.array([[0.002772, 0.0083], [0.002786, 0.0083]]), 1.0, ORDER).groups) == 1
