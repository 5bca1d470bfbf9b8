"""The ridge against its closed form by hand, and held-out folds against fits that really leave the rows out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rig_bench import compared, strokes

from diagnosis.prepare.rows import FOLDS, Column, Comparison
from diagnosis.regression import Fitted, Regression
from diagnosis.report.result import Array

AXES = ("turn", "lift")
SPREADS = np.array([0.3, np.inf, 0.05])
SCALE = {"turn": 0.7, "lift": 2.5}
FLOOR = {"turn": 0.1, "lift": 0.4}


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    return compared(tmp_path_factory.mktemp("rig"), strokes(1, 14.0))


@pytest.fixture(scope="module")
def columns(comparison: Comparison) -> list[Column]:
    """Three causes: on both axes, on one, on the other; and a fourth to be tried beside them."""
    rng = np.random.default_rng(0)
    rows = {axis: len(comparison.target[axis]) for axis in AXES}
    acting = (AXES, ("turn",), ("lift",), ("turn",))
    return [{axis: (1.0 + k) * rng.standard_normal(rows[axis]) for axis in axes} for k, axes in enumerate(acting)]


@pytest.fixture(scope="module")
def target(columns: list[Column]) -> dict[str, Array]:
    rng = np.random.default_rng(1)
    true = (0.4, -2.0, 0.1)
    found = {axis: rng.standard_normal(len(columns[0][axis])) for axis in AXES}
    for column, coefficient in zip(columns, true, strict=False):
        for axis, values in column.items():
            found[axis] = found[axis] + coefficient * values
    return found


@pytest.fixture(scope="module")
def regression(comparison: Comparison, columns: list[Column], target: dict[str, Array]) -> Regression:
    return Regression(comparison, columns[:3], SPREADS.tolist(), target, SCALE, FLOOR, {("delay", "turn"): frozenset({1})})


def stacked(columns: list[Column], target: dict[str, Array], keep: dict[str, Array]) -> tuple[Array, Array]:
    """Rows of both axes that are kept, each divided by its axis's scale: (N, p), (N,)."""
    matrices, values = [], []
    for axis in AXES:
        zeros = np.zeros(len(target[axis]))
        matrix = np.column_stack([column.get(axis, zeros) for column in columns])
        matrices.append(matrix[keep[axis]] / SCALE[axis])
        values.append(target[axis][keep[axis]] / SCALE[axis])
    return np.vstack(matrices), np.concatenate(values)


def by_hand(columns: list[Column], target: dict[str, Array], keep: dict[str, Array]) -> Array:
    """Ridge as least squares of an augmented system: below the rows, each coefficient over its spread is to be 0."""
    matrix, values = stacked(columns, target, keep)
    priors = np.diag(1.0 / np.concatenate([SPREADS, np.full(len(columns) - 3, np.inf)]))
    return np.linalg.lstsq(np.vstack([matrix, priors]), np.concatenate([values, np.zeros(len(columns))]), rcond=None)[0]


def everything(target: dict[str, Array]) -> dict[str, Array]:
    return {axis: np.ones(len(target[axis]), dtype=bool) for axis in AXES}


def test_coefficients_are_those_of_the_augmented_system(
    regression: Regression, columns: list[Column], target: dict[str, Array]
) -> None:
    fitted = regression.fit()
    expected = by_hand(columns[:3], target, everything(target))
    np.testing.assert_allclose(fitted.coefficients, expected, rtol=1e-6)
    assert fitted.prior_cost == pytest.approx(0.5 * ((expected[0] / 0.3) ** 2 + (expected[2] / 0.05) ** 2), rel=1e-6)


def test_a_further_column_is_free(regression: Regression, columns: list[Column], target: dict[str, Array]) -> None:
    fitted = regression.fit([columns[3]])
    np.testing.assert_allclose(fitted.coefficients, by_hand(columns, target, everything(target)), rtol=1e-6, atol=1e-9)


def test_held_out_error_is_that_of_fits_without_the_rows(
    regression: Regression, comparison: Comparison, columns: list[Column], target: dict[str, Array]
) -> None:
    expected = dict.fromkeys(AXES, 0.0)
    for fold in range(FOLDS):
        keep = everything(target)
        for axis in AXES:
            keep[axis][comparison.folds[axis][fold]] = False
        coefficients = by_hand(columns, target, keep)
        for axis in AXES:
            zeros = np.zeros(len(target[axis]))
            matrix = np.column_stack([column.get(axis, zeros) for column in columns])
            expected[axis] += float(np.sum((target[axis] - matrix @ coefficients)[~keep[axis]] ** 2))
    assert regression.fit([columns[3]]).held_out == pytest.approx(expected, rel=1e-6)


def test_a_held_column_is_as_if_it_were_not_there(
    comparison: Comparison, regression: Regression, columns: list[Column], target: dict[str, Array]
) -> None:
    held = regression.fit(held=regression.replaced_by("delay", "turn"))
    without = Regression(comparison, [columns[0], columns[2]], [0.3, 0.05], target, SCALE, FLOOR, {}).fit()
    assert held.coefficients[1] == 0.0
    np.testing.assert_allclose(held.coefficients[[0, 2]], without.coefficients, rtol=1e-6)
    assert held.held_out == pytest.approx(dict(without.held_out), rel=1e-6)
    assert held.prior_cost == pytest.approx(without.prior_cost, rel=1e-6)
    assert regression.replaced_by("delay", "lift") == frozenset()


def test_another_target_is_fitted_as_if_it_had_been_the_usual_one(
    comparison: Comparison, regression: Regression, columns: list[Column], target: dict[str, Array]
) -> None:
    changed = {"turn": target["turn"] - 0.8 * columns[3]["turn"]}
    other = Regression(comparison, columns[:3], SPREADS.tolist(), target | changed, SCALE, FLOOR, {})
    one, usual = regression.fit(target=changed), other.fit()
    np.testing.assert_allclose(one.coefficients, usual.coefficients, rtol=1e-9)
    assert one.held_out == pytest.approx(dict(usual.held_out), rel=1e-9)


def test_many_trials_at_once_are_fitted_as_one_by_one(regression: Regression) -> None:
    """Of one and of two columns, in an order of their own, with and without a column that is held."""
    rng = np.random.default_rng(3)
    trials = [[rng.standard_normal(regression.rows["turn"]) for _ in range(count)] for count in (2, 1, 2, 1, 1)]
    for held in (frozenset[int](), frozenset({1})):
        found = regression.fit_each("turn", trials, held)
        assert len(found) == len(trials)
        for columns, one in zip(trials, found, strict=True):
            alone = regression.fit([{"turn": column} for column in columns], held=held)
            np.testing.assert_allclose(one.coefficients, alone.coefficients, rtol=1e-9, atol=1e-12)
            assert one.held_out == pytest.approx(alone.held_out, rel=1e-9)
            assert one.prior_cost == pytest.approx(alone.prior_cost, rel=1e-9)
    assert regression.fit_each("turn", []) == []


def test_residual_is_target_less_columns(regression: Regression, columns: list[Column], target: dict[str, Array]) -> None:
    fitted = regression.fit([columns[3]])
    a, b, _, d = fitted.coefficients
    expected = target["turn"] - a * columns[0]["turn"] - b * columns[1]["turn"] - d * columns[3]["turn"]
    np.testing.assert_allclose(regression.residual(fitted, [columns[3]])["turn"], expected, atol=1e-9)


def test_evidence_grows_by_half_a_nat_an_independent_row_and_unit_of_logarithm(regression: Regression) -> None:
    rows = regression.rows["turn"]
    plain = Fitted(np.zeros(3), {"turn": 4.0 * rows, "lift": 9.0 * regression.rows["lift"]}, 0.0)
    better = replace(plain, held_out={**plain.held_out, "turn": 1.0 * rows}, prior_cost=1.5)
    gain = regression.evidence(better, {"turn": 20.0, "lift": 30.0}) - regression.evidence(plain, {"turn": 20.0, "lift": 30.0})
    assert gain == pytest.approx(0.5 * rows / 20.0 * np.log((4.0 + 0.01) / (1.0 + 0.01)) - 1.5)


def test_evidence_counts_little_below_the_floor(regression: Regression) -> None:
    def left(rms: float) -> Fitted:
        return Fitted(np.zeros(3), {axis: rms**2 * rows for axis, rows in regression.rows.items()}, 0.0)

    above = regression.evidence(left(2.0)) - regression.evidence(left(4.0))
    below = regression.evidence(left(0.002)) - regression.evidence(left(0.004))
    assert 0.0 < below < 1e-2 * above


def test_a_column_of_zeros_gets_nothing(comparison: Comparison, columns: list[Column], target: dict[str, Array]) -> None:
    nothing = {axis: np.zeros(len(values)) for axis, values in target.items()}
    regression = Regression(comparison, [columns[0], nothing], [0.3, np.inf], target, SCALE, FLOOR, {})
    alone = Regression(comparison, [columns[0]], [0.3], target, SCALE, FLOOR, {})
    fitted = regression.fit()
    assert fitted.coefficients[1] == 0.0
    assert fitted.coefficients[0] == pytest.approx(alone.fit().coefficients[0])
