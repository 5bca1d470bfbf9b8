"""What a patch keeps: nothing that leaves more of the gap on unseen motion than the simulation as it stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plain_bench as plain
import pytest
from rig_bench import CARRIAGE, COULOMB, GRAVITY, as_modelled, compared, moved, ready, strokes

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.prediction import Patch
from drivetwin.diagnosis.report.worth import worth_a_name, worth_as_it_stands
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.refit import refitted
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_constant import TorqueConstant
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.emulator.effects.viscous_asymmetry import ViscousAsymmetry


@pytest.mark.parametrize(("resists", "more"), [(0.0, 4.0), (2.0, 4.97), (2.0, 5.03)], ids=["harm", "a little", "a little harm"])
def test_two_effects_that_need_each_other_and_close_nothing_together_are_left_out(
    resists: float, more: float, tmp_path: Path
) -> None:
    """5 N less and about as much more, of a lift that resists more than modelled: without either alone more is left."""
    made = ready(tmp_path, strokes(1, 8.0, {"lift": lambda at: resists * np.sign(at.velocity) + 0.03 * (resists > 0.0)}))
    patch = Patch(tuple(placed(made.rows, "lift", one) for one in (CoulombAsymmetry(more), TorqueOffset(5.0))))
    assert worth_as_it_stands(made, patch, 0.01).effects == ()


def test_two_effects_that_undo_each_other_are_left_out_beside_one_that_closes_the_gap(tmp_path: Path) -> None:
    made = ready(tmp_path, strokes(1, 8.0, {"lift": lambda at: 2.0 * np.sign(at.velocity)}))
    true = Coulomb(COULOMB["lift"] + 2.0)
    patch = Patch(tuple(placed(made.rows, "lift", one) for one in (true, CoulombAsymmetry(5.0), TorqueOffset(5.0))))
    assert [one.effect for one in worth_as_it_stands(made, patch, 0.01).effects] == [true]


def test_what_the_others_can_do_without_is_left_out_and_they_are_fitted_again(tmp_path: Path) -> None:
    """A torque constant, and friction and inertia that undo it: without any one of them alone a tenth of the torque is left."""
    told = plain.Machine()
    path = tmp_path / "plain.xml"
    path.write_text(told.model, encoding="utf-8")
    made = prepared(path, [told.recording(1, 20.0, "fitted")], [told.recording(2, 20.0, "held")], Settings())
    bench = bench_of(made.rows, Settings(), made.absolute)
    true = Stribeck(plain.COULOMB + plain.STICKS, plain.SLIDES, 2.0), TorqueRipple(plain.COGGING, plain.ORDER, plain.PHASE)
    undone = TorqueConstant(0.1), Coulomb(1.1 * plain.COULOMB), Viscous(1.1 * plain.VISCOUS), Inertia(0.1 * plain.INERTIA)
    values = refitted(state_of(bench, [placed(made.rows, "turn", one) for one in (*true, *undone)], bench.white, {}), ())
    as_it_stands = {one.effect.name for one in worth_as_it_stands(made, Patch(values.effects), 0.01).effects}
    assert as_it_stands > {"torque_constant", "coulomb", "stribeck", "torque_ripple"}
    values, patch = worth_a_name(made, values, (), 0.01)
    assert {one.effect.name for one in patch.effects} == {"stribeck", "torque_ripple"}
    assert all(any(one is each for each in values.effects) for one in patch.effects)
    sticks = next(one.effect for one in values.effects if isinstance(one.effect, Stribeck))
    assert sticks.static_torque == pytest.approx(true[0].static_torque, rel=0.02)


@pytest.mark.parametrize(("turns", "kept"), [(-0.2, True), (0.2, False)])
def test_no_axis_pays_for_another(turns: float, kept: bool, tmp_path: Path) -> None:
    """A heavier carriage closes the gap of the lift. It adds to that of a turn which has less inertia than its model."""
    more = {"lift": lambda at: 0.1 * CARRIAGE * (GRAVITY + at.acceleration), "turn": lambda at: -turns * at.acceleration}
    made = ready(tmp_path, strokes(1, 8.0, more))
    carriage = max(made.simulation.moving_bodies())
    patch = Patch((), {carriage: 0.1})
    assert worth_as_it_stands(made, patch, 0.01).heavier == (patch.heavier if kept else None)


@pytest.mark.parametrize(
    ("share", "lags", "resists"), [(0.03, 0.170, 0.01), (0.5, 0.01, 0.0013)], ids=["small gap", "large gap"]
)
def test_what_the_errors_of_a_comparison_look_like_must_explain_more_than_they(
    share: float, lags: float, resists: float, tmp_path: Path
) -> None:
    """Of a gap of 3 % of the torque of motion, a comparison that errs by 1.2 % makes 17 %: a spring of 10 % of it is none."""
    both = moved(1, 20.0)
    torques = as_modelled(both)
    of_motion = torques["lift"] - CARRIAGE * GRAVITY
    more = {"lift": lambda _: share * of_motion}
    rows = compared(tmp_path, strokes(1, 20.0, more, noise=0.0))
    bench = bench_of(rows, Settings(), {"turn": True, "lift": True})
    spring, drag = (placed(rows, "lift", one) for one in (Elasticity(1e5, 10.0), ViscousAsymmetry(1.0)))
    assert bench.least(spring) == pytest.approx(lags, rel=0.1)
    assert bench.least(drag) == pytest.approx(resists, rel=0.1)
