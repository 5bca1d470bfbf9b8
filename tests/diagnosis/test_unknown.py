"""The smooth unknown: its columns reproduce the kernel that it is said to have, and go with what they are said to go with."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from rig_bench import PERIOD, compared, strokes

from drivetwin.diagnosis.model.beside import Inner
from drivetwin.diagnosis.model.unknown import Component, by_quantity, components
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.report.result import Array
from drivetwin.motion.filtering import reach
from drivetwin.motion.moving import widen

WAVES = 4.0


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Rows:
    return compared(tmp_path_factory.mktemp("rig"), strokes(1, 20.0))


def of(rows: Rows, quantity: str, absolute: bool = True) -> list[Component]:
    return [one for one in components(rows, "lift", WAVES, absolute, nothing(rows)) if one.goes_with == quantity]


def nothing(rows: Rows) -> Array:
    """Of a model that has no parameters."""
    return np.zeros((rows.count("lift"), 0))


def clear(rows: Rows) -> NDArray[np.intp]:
    """Some rows (numbers) far from any standstill, where a filter changes little of what varies slowly."""
    far = 3 * reach(PERIOD, rows.runs[0].cutoff_hz)
    moves = rows.picked("lift", [(~widen(run.axes["lift"].sticks, far)).astype(np.float64) for run in rows.runs])
    return np.flatnonzero(moves > 0.5)[::7]


def kernel(at: Array) -> Array:
    return np.asarray(np.exp(-0.5 * ((at[:, None] - at) * WAVES) ** 2))


def test_over_position_it_is_the_squared_exponential_kernel_with_and_without_the_direction(rows: Rows) -> None:
    pick = clear(rows)
    place = rows.rows("lift", lambda _, own: own.motion.position)[pick]
    whole = rows.motion["lift"].position
    at = (place - whole.min()) / np.ptp(whole)
    direction = np.sign(rows.rows("lift", lambda _, own: own.motion.velocity)[pick])
    plain, turned = (one.columns[pick] for one in of(rows, "position"))
    np.testing.assert_allclose(plain @ plain.T, kernel(at), atol=0.03)
    np.testing.assert_allclose(turned @ turned.T, np.outer(direction, direction) * kernel(at), atol=0.03)


def test_over_time_it_is_the_squared_exponential_kernel_times_the_direction(rows: Rows) -> None:
    pick = clear(rows)
    time = rows.rows("lift", lambda run, _: run.recording.time)[pick]
    direction = np.sign(rows.rows("lift", lambda _, own: own.motion.velocity)[pick])
    (found,) = (one.columns[pick] for one in of(rows, "time"))
    told = np.outer(direction, direction) * kernel((time - time.min()) / 20.0)
    np.testing.assert_allclose(found @ found.T, told, atol=0.03)


def test_a_component_has_an_rms_of_one_everywhere(rows: Rows) -> None:
    """So that a setting says how large the unknown is."""
    for one in components(rows, "lift", 8.0, True, nothing(rows)):
        level = np.sqrt(np.sum(one.columns[clear(rows)] ** 2, axis=1))
        assert np.median(level) == pytest.approx(1.0, abs=0.05), one.goes_with


def test_more_waves_are_more_columns(rows: Rows) -> None:
    few, many = (components(rows, "lift", waves, True, nothing(rows))[0].columns.shape[1] for waves in (2.0, 8.0))
    assert few < many


def test_a_position_that_is_relative_has_no_curve(rows: Rows) -> None:
    assert len(of(rows, "position", absolute=True)) == 2
    assert of(rows, "position", absolute=False) == []


def test_a_smooth_curve_over_speed_is_within_its_reach(rows: Rows) -> None:
    """A Stribeck curve with an exponent of no effect: least squares leave a hundredth of its energy."""
    velocity = rows.rows("lift", lambda _, own: own.motion.velocity)
    curve = np.sign(velocity) * np.exp(-((np.abs(velocity) / 0.05) ** 1.4))
    columns = np.column_stack([one.columns for one in of(rows, "velocity") + of(rows, "direction")])
    pick = clear(rows)
    left = curve[pick] - columns[pick] @ np.linalg.lstsq(columns[pick], curve[pick], rcond=1e-8)[0]
    assert np.mean(left**2) < 0.01 * np.mean(curve[pick] ** 2)


def test_it_has_nothing_of_what_the_model_s_own_parameters_cost(rows: Rows) -> None:
    """Else a wrong Coulomb friction, a curve as smooth as any, would be told by neither."""
    velocity = rows.rows("lift", lambda run, own: run.felt(own, own.motion.velocity))
    friction = rows.rows("lift", lambda run, own: run.felt(own, np.sign(own.motion.velocity)))
    known = np.column_stack([friction, velocity, friction + velocity])  # one of them twice
    found = components(rows, "lift", WAVES, True, known)
    for one in found:
        overlap = known.T @ one.columns / np.linalg.norm(known, axis=0)[:, None]
        assert np.abs(overlap).max() < 1e-8 * np.linalg.norm(one.columns)
    assert sum(np.linalg.norm(one.columns) for one in found) > 0.5 * np.sqrt(len(known))


def test_what_it_goes_with_is_told_most_first_and_from_a_tenth_on() -> None:
    assert by_quantity({"time": 0.05, "velocity": 0.6, "position": 0.35}) == ["velocity", "position"]
    assert by_quantity({"time": 0.0}) == []
    assert by_quantity({}) == []


def test_an_amplitude_of_which_rows_tell_nothing_is_as_large_as_its_prior_has_it() -> None:
    """told a² + a³ / misfit = squares with nothing told: a = (squares misfit)^(1/3), and not what steps from afar come to."""
    inner = Inner.of(1e-30 * np.eye(1), np.ones(1), 1.0)
    found = inner.tuned(np.zeros(1, dtype=np.intp), np.array([5.0]), np.ones(1), 0.01)
    assert found == pytest.approx([(25.0 * 0.01) ** (1.0 / 3.0)], rel=1e-6)
