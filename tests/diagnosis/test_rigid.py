"""What a load or a shared inertia costs: the polynomial against the changed model itself, and against mechanics by hand."""

from __future__ import annotations

import numpy as np
import pytest
from rig_bench import ARM, GRAVITY, compared, strokes

from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.propose.rigid import Polynomial, polynomial, rigid_starts
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.emulator.effects.coupling import Coupling
from drivetwin.emulator.effects.payload import Payload
from drivetwin.emulator.effects.spring import Spring

RNG = np.random.default_rng(3)
PAYLOADS = [Payload(RNG.uniform(0.1, 3.0), *RNG.uniform(-0.7, 0.7, 3)) for _ in range(4)]
COUPLINGS = [Coupling(RNG.uniform(0.01, 2.0), RNG.uniform(-4.0, 4.0)) for _ in range(4)]


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Rows:
    return compared(tmp_path_factory.mktemp("rig"), strokes(1, 10.0))


@pytest.fixture(scope="module")
def acceleration(rows: Rows) -> dict[str, dict[str, Array]]:
    """By axis on whose rows, then by axis that accelerates."""
    turn = rows.rigid_rows(lambda motion: np.repeat(motion.acceleration[:, :1], 2, axis=1))
    lift = rows.rigid_rows(lambda motion: np.repeat(motion.acceleration[:, 1:], 2, axis=1))
    return {axis: {"turn": turn[axis], "lift": lift[axis]} for axis in ("turn", "lift")}


@pytest.fixture(scope="module")
def moves(rows: Rows) -> dict[str, Array]:
    """Share of each row in which its axis does not stick: then nothing is felt."""
    return {axis: rows.rows(axis, lambda run, own: run.moves(own)) for axis in ("turn", "lift")}


def known(rows: Rows, axis: str, kind: type[Payload] | type[Coupling]) -> Polynomial:
    found = polynomial(rows, axis, kind)
    assert found is not None
    return found


@pytest.mark.parametrize("payload", PAYLOADS)
@pytest.mark.parametrize("axis", ["turn", "lift"])
def test_the_polynomial_of_a_payload_is_what_the_loaded_model_says(rows: Rows, axis: str, payload: Payload) -> None:
    told, expected = known(rows, axis, Payload).column(payload), rows.predicted_by_model(axis, payload)
    assert set(told) == set(expected) == {"turn", "lift"}
    for name, torque in expected.items():
        np.testing.assert_allclose(told[name], torque, atol=1e-9 * (1.0 + np.abs(torque).max()))


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_the_polynomial_of_a_coupling_is_what_the_coupled_model_says(rows: Rows, coupling: Coupling) -> None:
    told, expected = known(rows, "lift", Coupling).column(coupling), rows.predicted_by_model("lift", coupling)
    for name, torque in expected.items():
        np.testing.assert_allclose(told[name], torque, atol=1e-9 * (1.0 + np.abs(torque).max()))


def test_a_payload_on_the_carriage_costs_weight_and_inertia(
    rows: Rows, acceleration: dict[str, dict[str, Array]], moves: dict[str, Array]
) -> None:
    told = known(rows, "lift", Payload).column(Payload(0.8, ARM, -0.4, 2.0))
    lifts, turns = 0.8 * (GRAVITY + acceleration["lift"]["lift"]), 0.8 * (ARM**2 + 0.16) * acceleration["turn"]["turn"]
    np.testing.assert_allclose(told["lift"], moves["lift"] * lifts, atol=1e-9)
    np.testing.assert_allclose(told["turn"], moves["turn"] * turns, atol=1e-9)


def test_a_coupling_costs_both_axes(rows: Rows, acceleration: dict[str, dict[str, Array]], moves: dict[str, Array]) -> None:
    told = known(rows, "lift", Coupling).column(Coupling(0.5, -2.0))
    shared = {axis: 0.5 * (both["lift"] - 2.0 * both["turn"]) for axis, both in acceleration.items()}
    np.testing.assert_allclose(told["lift"], moves["lift"] * shared["lift"], atol=1e-9)
    np.testing.assert_allclose(told["turn"], -2.0 * moves["turn"] * shared["turn"], atol=1e-9)


def test_the_first_axis_of_a_chain_has_nothing_to_be_coupled_with(rows: Rows) -> None:
    assert polynomial(rows, "turn", Coupling) is None


def test_how_high_a_load_rides_on_a_lift_is_no_parameter(rows: Rows) -> None:
    bench = bench_of(rows, Settings(), {"turn": True, "lift": True})
    load = bench.felt("lift", Payload(0.8, ARM, -0.4, 2.0), rows.simulation.dynamics(())["lift"])
    assert [field.name for field in load.movable] == ["mass", "x", "y"]
    assert len(load.tangents) == 3


def test_only_loads_that_cost_something_else_were_tried(rows: Rows) -> None:
    """Of 13 places that a load may have, those above and below the first cost what that one does."""
    bench = bench_of(rows, Settings(), {"turn": True, "lift": True})
    empty = state_of(bench, [], bench.white, {})
    starts = rigid_starts(empty.frugal, "lift", known(rows, "lift", Payload), frozenset())
    assert {start.tried for start in starts} == {len(starts)}
    assert len(starts) <= 9


def test_a_spring_that_pulls_alike_everywhere_is_none(rows: Rows) -> None:
    """Two springs that rest a travel to either side: equal ones are one in the middle, nearly opposite ones an offset."""
    motion = rows.motion["lift"]
    (start,) = Spring.starts(motion, rows.simulation.dynamics(())["lift"])
    middle = start.compose([3.0, 3.0])
    assert isinstance(middle, Spring)
    assert middle.rest == pytest.approx(float(np.mean(motion.position)))
    assert start.compose([3.0, -2.0]) is not None
    assert start.compose([3.0, -2.9]) is None
    low, high = middle.bounds(motion, rows.simulation.dynamics(())["lift"])["rest"]
    assert low < motion.position.min() < motion.position.max() < high
