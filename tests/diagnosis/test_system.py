"""Evidence, coefficients and held-out densities against dense Gaussians: every integral as one multivariate normal."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from scipy import optimize
from scipy.stats import multivariate_normal, multivariate_t
from weigh_bench import PERIOD, rows_of

from drivetwin.diagnosis.model import solve
from drivetwin.diagnosis.model.axis_system import AxisSystem, axis_system
from drivetwin.diagnosis.model.colour import Colour, colour_of, white
from drivetwin.diagnosis.model.system import FREEDOM, System
from drivetwin.diagnosis.model.system import system_of as made
from drivetwin.diagnosis.model.unknown import shapes
from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.report.result import Array

COUNT = {"turn": 60, "lift": 45}
NOISE = {"turn": 1.4, "lift": 1.1}
"""More than the levels that rows are divided by: those are never lowered."""
LEVEL = {"turn": 0.5, "lift": 2.0}
MISFIT = {"turn": 0.3, "lift": 1.0}
SPREADS = np.array([0.4, 0.2])
ONE = np.zeros(3, dtype=np.intp)
"""All columns of the unknown are one component."""
USUAL = 2.0
"""What the prior of the amplitudes costs both axes at their usual size: a nat each."""
LOG = np.log(2.0 * np.pi)
FOLDS = 4


def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def raw_unknown(axis: str) -> Array:
    """Columns that overlap, (N, 3)."""
    at = np.linspace(0.0, 1.0, COUNT[axis])
    return np.column_stack([np.ones_like(at), at, np.sin(5.0 * at)])


COLUMNS: list[Column] = [
    {axis: rng().standard_normal(count) * LEVEL[axis] for axis, count in COUNT.items()},
    {"turn": np.cos(np.arange(COUNT["turn"]))},
]
FREE: Column = {"lift": np.sin(0.7 * np.arange(COUNT["lift"]))}


def target() -> dict[str, Array]:
    draw = np.random.default_rng(12)
    found = {}
    for axis, count in COUNT.items():
        noise = NOISE[axis] * LEVEL[axis] * draw.standard_normal(count)
        found[axis] = noise + raw_unknown(axis) @ (MISFIT[axis] * draw.standard_normal(3))
        found[axis] = found[axis] + 0.3 * COLUMNS[0][axis] + 1.5 * FREE.get(axis, np.zeros(count))
    return found


def colours(kind: str) -> dict[str, Colour]:
    """White noise, or that of a residual that remembers one row."""
    found = {}
    for axis, count in COUNT.items():
        rows = rows_of((count - 13, 13), blocks=8)
        remembers = np.convolve(np.random.default_rng(5).standard_normal(count), [1.0, 0.7], "same") * LEVEL[axis]
        clocks = np.array([[PERIOD, PERIOD]])
        found[axis] = (
            white(rows, clocks, LEVEL[axis], 3) if kind == "white" else colour_of(rows, clocks, remembers, 3, 0.1)
        )
    return found


def system_of(colour: Mapping[str, Colour], columns: list[Column] = COLUMNS, spreads: Array = SPREADS) -> System:
    rows = {axis: rows_of((count - 13, 13), blocks=8) for axis, count in COUNT.items()}
    axes: dict[str, AxisSystem] = {
        axis: axis_system(colour[axis], raw_unknown(axis), ONE, MISFIT[axis], target()[axis], rows[axis].block)
        for axis in COUNT
    }
    return made(axes, [{axis: colour[axis].whiten(part) for axis, part in one.items()} for one in columns], spreads)


def whitening(colour: Colour, count: int) -> Array:
    """W (N, N): whitened rows are W times rows."""
    return colour.whiten(np.eye(count))


def covariance_of(axis: str, colour: Colour, level: float) -> Array:
    """Of an axis's rows given the coefficients: coloured noise, and the unknown integrated out."""
    inverse = np.linalg.inv(whitening(colour, COUNT[axis]))
    unknown = raw_unknown(axis)
    return np.asarray(level**2 * inverse @ inverse.T + MISFIT[axis] ** 2 * unknown @ unknown.T)


def stacked(columns: list[Column]) -> Array:
    """Columns (N, p), the rows of both axes one after the other."""
    return np.column_stack([np.concatenate([one.get(a, np.zeros(n)) for a, n in COUNT.items()]) for one in columns])


def dense(colour: Mapping[str, Colour], level: Mapping[str, float], columns: list[Column], spreads: Array) -> Array:
    """Covariance (N, N) of the rows of both axes, with the columns' coefficients integrated out."""
    whole = np.zeros((sum(COUNT.values()),) * 2)
    at = 0
    for axis, count in COUNT.items():
        whole[at : at + count, at : at + count] = covariance_of(axis, colour[axis], level[axis])
        at += count
    scaled = stacked(columns) * spreads
    return whole + scaled @ scaled.T


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_evidence_is_the_density_of_one_gaussian_over_all_rows(kind: str) -> None:
    """At the noise levels that the fit found; constants of the density aside, which no comparison needs."""
    colour = colours(kind)
    fit = system_of(colour).fit()
    rows = np.concatenate(list(target().values()))
    told = multivariate_normal(np.zeros(len(rows)), dense(colour, fit.level, COLUMNS, SPREADS)).logpdf(rows)
    assert fit.evidence == pytest.approx(told + 0.5 * len(rows) * LOG - USUAL, abs=1e-4)


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_coefficients_and_their_covariance_are_the_conditional_ones(kind: str) -> None:
    colour = colours(kind)
    fit = system_of(colour).fit()
    given = dense(colour, fit.level, COLUMNS, 0.0 * SPREADS)
    columns, rows = stacked(COLUMNS), np.concatenate(list(target().values()))
    information = columns.T @ np.linalg.solve(given, columns) + np.diag(SPREADS**-2.0)
    np.testing.assert_allclose(fit.covariance, np.linalg.inv(information), rtol=1e-6)
    right = columns.T @ np.linalg.solve(given, rows)
    np.testing.assert_allclose(fit.coefficients, np.linalg.solve(information, right), rtol=1e-6)


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_a_free_column_is_generalised_least_squares_and_costs_half_the_logarithm_of_independent_rows(kind: str) -> None:
    colour = colours(kind)
    system = system_of(colour)
    fit = system.fit([system.whiten(FREE)])
    rows, given = np.concatenate(list(target().values())), dense(colour, fit.level, COLUMNS, SPREADS)
    column = stacked([FREE])[:, 0]
    value = float(column @ np.linalg.solve(given, rows) / (column @ np.linalg.solve(given, column)))
    assert fit.coefficients[-1] == pytest.approx(value, rel=1e-6)
    told = multivariate_normal(np.zeros(len(rows)), given).logpdf(rows - value * column)
    independent = sum(one.independent for one in colour.values())
    assert kind == "coloured" or independent == len(rows)
    assert fit.evidence == pytest.approx(told + 0.5 * len(rows) * LOG - USUAL - 0.5 * np.log(independent), abs=1e-4)


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_a_tangent_holds_near_its_point_and_costs_as_much_as_a_free_column(kind: str) -> None:
    """Generalised ridge regression (Hoerl and Kennard, Technometrics 12(1), 1970, eq. 4.1)."""
    colour, near = colours(kind), 3000.0
    system = system_of(colour)
    fit = system.fit([system.whiten(FREE)], near=near)
    rows, given = np.concatenate(list(target().values())), dense(colour, fit.level, COLUMNS, SPREADS)
    column = stacked([FREE])[:, 0]
    value = float(column @ np.linalg.solve(given, rows) / (column @ np.linalg.solve(given, column) + near))
    free = system.fit([system.whiten(FREE)]).coefficients[-1]
    assert fit.coefficients[-1] == pytest.approx(value, rel=1e-6)
    assert abs(value) < 0.8 * abs(free)
    told = multivariate_normal(np.zeros(len(rows)), given).logpdf(rows - value * column) - 0.5 * near * value**2
    independent = sum(one.independent for one in colour.values())
    assert fit.evidence == pytest.approx(told + 0.5 * len(rows) * LOG - USUAL - 0.5 * np.log(independent), abs=1e-4)


def test_the_noise_level_is_where_the_evidence_is_highest() -> None:
    """Of the penalised residual: its square over the rows, which three turns bring within a hundredth."""
    colour = colours("white")
    fit = system_of(colour).fit()
    rows = np.concatenate(list(target().values()))

    def cost(levels: Array) -> float:
        given = dense(colour, dict(zip(COUNT, np.exp(levels), strict=True)), COLUMNS, SPREADS)
        return -float(multivariate_normal(np.zeros(len(rows)), given).logpdf(rows))

    best = np.exp(optimize.minimize(cost, np.zeros(2), method="Nelder-Mead").x)
    np.testing.assert_allclose([fit.level[axis] for axis in COUNT], best, rtol=0.1)


def test_a_held_column_is_as_if_it_were_not_there() -> None:
    colour = colours("coloured")
    held = system_of(colour).fit(held=frozenset({0}))
    without = system_of(colour, COLUMNS[1:], SPREADS[1:]).fit()
    assert held.coefficients[0] == 0.0
    np.testing.assert_allclose(held.coefficients[1:], without.coefficients, rtol=1e-9)
    assert held.evidence == pytest.approx(without.evidence, abs=1e-9)


def test_what_is_taken_off_the_target_is_as_if_it_had_never_been_there() -> None:
    colour = colours("coloured")
    system = system_of(colour)
    plain = system.fit([system.whiten(FREE)])
    less = system.fit([system.whiten(FREE)], {"lift": 0.4 * system.whiten(FREE)["lift"]})
    assert less.coefficients[-1] == pytest.approx(plain.coefficients[-1] - 0.4, rel=1e-6)
    np.testing.assert_allclose(less.coefficients[:-1], plain.coefficients[:-1], rtol=1e-6)


def test_a_column_that_is_nowhere_changes_no_coefficient_and_gives_finite_figures() -> None:
    """Where a payload hangs along a vertical slide is felt by nobody."""
    colour = colours("white")
    nothing: Column = {axis: np.zeros(count) for axis, count in COUNT.items()}
    system = system_of(colour, [*COLUMNS, nothing], np.append(SPREADS, np.inf))
    plain, fit = system_of(colour).fit(), system.fit()
    np.testing.assert_allclose(fit.coefficients, np.append(plain.coefficients, 0.0), rtol=1e-9)
    left = system.projector(list(COUNT), fit, frozenset()).left({axis: own.target for axis, own in system.axes.items()})
    assert np.isfinite(left).all()


def test_the_sum_of_squares_that_a_search_minimises_is_that_of_the_evidence() -> None:
    """Twice the negative logarithm of the density at fixed levels, but for its determinant."""
    colour = colours("coloured")
    system = system_of(colour)
    fit = system.fit()
    left = system.projector(list(COUNT), fit, frozenset()).left({axis: own.target for axis, own in system.axes.items()})
    rows = np.concatenate(list(target().values()))
    expected = float(rows @ np.linalg.solve(dense(colour, fit.level, COLUMNS, SPREADS), rows))
    assert float(left @ left) == pytest.approx(expected, rel=1e-6)


def test_the_unknown_s_mean_is_the_conditional_one() -> None:
    colour = colours("coloured")
    system = system_of(colour)
    for axis, own in system.axes.items():
        rows, level = target()[axis], 1.3
        shared = MISFIT[axis] ** 2 * raw_unknown(axis) @ raw_unknown(axis).T
        mean = shared @ np.linalg.solve(covariance_of(axis, colour[axis], level), rows)
        np.testing.assert_allclose(system.unknown_of(axis, own.target, level), colour[axis].whiten(mean), atol=1e-8)


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_held_out_densities_are_those_of_fits_without_the_rows(kind: str) -> None:
    """Each block's whitened rows: coefficients fitted without its fold, the unknown by its prior; t with four degrees."""
    colour = colours(kind)
    system = system_of(colour)
    folds = {axis: np.arange(8) % FOLDS for axis in COUNT}
    found = system.held_out(folds, FOLDS, [system.whiten(FREE)], None)
    amplitude = system.fit_tuned([system.whiten(FREE)], None, frozenset()).amplitude
    expected = {axis: np.zeros(8) for axis in COUNT}
    for fold in range(FOLDS):
        kept = {axis: folds[axis][own.blocks] != fold for axis, own in system.axes.items()}
        part = made(
            {axis: _only(own, kept[axis]) for axis, own in system.axes.items()},
            [{axis: rows[kept[axis]] for axis, rows in one.items()} for one in [*system.columns, system.whiten(FREE)]],
            np.append(SPREADS, np.inf),
        ).at(amplitude)
        fit = part.fit()
        for axis, own in system.axes.items():
            columns = [one.get(axis, np.zeros(COUNT[axis])) for one in [*system.columns, system.whiten(FREE)]]
            left = own.target - np.column_stack(columns) @ fit.coefficients
            shared = amplitude[axis][0] ** 2 * own.unknown @ own.unknown.T
            for block in np.unique(own.blocks[~kept[axis]]):
                here = own.blocks == block
                spread = shared[np.ix_(here, here)] + fit.level[axis] ** 2 * np.eye(int(here.sum()))
                scale = spread * (FREEDOM - 2.0) / FREEDOM
                full = multivariate_t(np.zeros(len(spread)), scale, int(FREEDOM)).logpdf(left[here])
                expected[axis][block] = full + 0.5 * here.sum() * np.log(2.0 * np.pi)
    for axis, densities in expected.items():
        np.testing.assert_allclose(found[axis], densities, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_what_acts_on_one_axis_hardly_changes_the_others(kind: str) -> None:
    """Their noise level is not found anew: evidence and coefficients are those of all levels found together, nearly."""
    colour = colours(kind)
    within = system_of(colour, [*COLUMNS, FREE], np.append(SPREADS, np.inf)).fit()
    beside = system_of(colour).fit([system_of(colour).whiten(FREE)])
    assert beside.evidence == pytest.approx(within.evidence, abs=0.02)
    assert beside.coefficients == pytest.approx(within.coefficients, rel=0.02)
    assert beside.level["turn"] == system_of(colour).fit().level["turn"]


def _free_of_logarithm(count: int) -> Colour:
    """Rows that are white already."""
    return white(rows_of((count,)), np.array([[PERIOD, PERIOD]]), 1.0, 3)


def _only(own: AxisSystem, kept: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> AxisSystem:
    """Some rows of an axis."""
    unknown = own.unknown[kept]
    return AxisSystem(
        _free_of_logarithm(len(unknown)), unknown, unknown.T @ unknown, ONE, own.misfit, own.target[kept], own.blocks[kept]
    )


@pytest.mark.parametrize("times", [2.0, 10.0])
def test_amplitudes_are_where_the_evidence_is_highest(times: float) -> None:
    """Of the dense Gaussian with the exponential prior, at the level that the fit found."""
    colour, unknown, count = colours("coloured")["turn"], raw_unknown("turn"), COUNT["turn"]
    rows = unknown @ (times * MISFIT["turn"] * np.array([1.0, -1.3, 0.8])) + 0.6 * rng().standard_normal(count)
    own = axis_system(colour, unknown, ONE, MISFIT["turn"], rows, np.zeros(count, dtype=np.intp))
    system = made({"turn": own}, [], np.zeros(0))
    fit = system.fit_tuned((), None, frozenset())
    inverse = np.linalg.inv(whitening(colour, count))

    def cost(logarithm: float) -> float:
        scaled = np.exp(logarithm) * unknown
        covariance = fit.level["turn"] ** 2 * inverse @ inverse.T + scaled @ scaled.T
        rare = np.exp(logarithm) / MISFIT["turn"]
        return float(rare - multivariate_normal(np.zeros(count), covariance).logpdf(rows))

    best = optimize.minimize_scalar(cost, bounds=(-6.0, 4.0), method="bounded")
    assert fit.amplitude["turn"][0] == pytest.approx(np.exp(best.x), rel=0.05)
    assert fit.evidence == pytest.approx(-best.fun + 0.5 * count * LOG, abs=0.02)
    assert fit.evidence > system.fit().evidence


def smooth_rows(seed: int) -> System:
    """White noise, and from nothing to much of curves over speed, position and time, with and without the direction; the
    noise's level is not quite known.
    """
    draw, count = np.random.default_rng(seed), 300
    time = np.linspace(0.0, 1.0, count)
    angle = 2.0 * np.pi * draw.uniform(3.0, 9.0) * time + 0.3 * np.cumsum(draw.uniform(-0.3, 0.3, count))
    position = np.sin(angle) + 0.5 * np.sin(0.37 * angle)
    velocity = np.gradient(position, time)
    at = [np.abs(velocity) / np.abs(velocity).max(), (position - position.min()) / np.ptp(position), time]
    curves, knots = shapes(3.0), np.linspace(0.0, 1.0, 25)
    ways = [np.ones(count), np.sign(velocity)]
    parts = [np.column_stack([np.interp(each, knots, one) * way for one in curves.T]) for each in at for way in ways]
    noise = 10.0 ** draw.uniform(-2.5, 0.3)
    rows = noise * draw.standard_normal(count)
    for part in parts:
        if draw.random() < 0.5:
            rows += part @ draw.standard_normal(part.shape[1]) * 10.0 ** draw.uniform(-2.0, 1.0)
    colour = white(rows_of((count,), blocks=8), np.array([[PERIOD, PERIOD]]), noise * 10.0 ** draw.uniform(-0.5, 0.5), 3)
    component = np.repeat(np.arange(len(parts)), [part.shape[1] for part in parts])
    own = axis_system(colour, np.column_stack(parts), component, 1.0, rows, np.zeros(count, dtype=np.intp))
    return made({"turn": own}, [], np.zeros(0))


def test_amplitudes_of_many_components_are_found_in_a_few_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside MacKay's iteration without any extrapolation, to its end."""
    systems = [smooth_rows(seed) for seed in range(60)]
    found = [system.fit_tuned((), None, frozenset()).evidence for system in systems]
    monkeypatch.setattr(solve, "TUNED", 150)
    monkeypatch.setattr(solve, "farther", lambda _first, _second, third, _misfit: third)
    missed = [system.fit_tuned((), None, frozenset()).evidence - each for system, each in zip(systems, found, strict=True)]
    assert np.mean(missed) < 0.1
    assert np.max(missed) < 1.0


def test_amplitudes_do_not_depend_on_which_axis_is_asked_first() -> None:
    """Names of axes in a set come in another order in each process; one axis is at its end turns before another."""
    for seed in range(0, 20, 2):
        alone = {axis: smooth_rows(seed + k) for k, axis in enumerate(("turn", "lift"))}
        system = made({axis: one.axes["turn"] for axis, one in alone.items()}, [], np.zeros(0))
        prior = system._prior(())
        first, second = (
            solve.solved(system.axes, system.products, prior, frozenset(), system.amplitude, order)
            for order in (("turn", "lift"), ("lift", "turn"))
        )
        assert first.evidence == second.evidence
        for axis, amplitude in first.amplitude.items():
            np.testing.assert_array_equal(amplitude, second.amplitude[axis])


def test_an_unknown_that_is_not_there_vanishes() -> None:
    """Noise alone: the evidence pays for every curve that it may have."""
    colour = colours("white")
    own = axis_system(
        colour["turn"], raw_unknown("turn"), ONE, MISFIT["turn"], np.zeros(COUNT["turn"]), np.zeros(60, dtype=np.intp)
    )
    amplitude = made({"turn": own}, [], np.zeros(0)).tuned().amplitude["turn"]
    assert amplitude[0] <= 1e-2 * MISFIT["turn"]
