"""A second encoder behind the gear: what of it is compared, and a gear error that torque alone hardly tells from a ripple."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, GEAR, MOTOR, TURNING, VISCOUS, as_modelled, compared, diagnosed, moved, ready, recording, strokes

from drivetwin.diagnosis.prepare.deflection import deflection_of
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Unexplained, weighed
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.proposal import Family
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects.transmission_error import TransmissionError
from drivetwin.recording.recording import Recording

AMPLITUDE, ORDER, PHASE = 3e-4, 2.0, 0.7
WAVE = ORDER * GEAR


def uneven(seed: int, name: str = "strokes", amplitude: float = AMPLITUDE) -> Recording:
    """q = m + e(m) of `turn`, whose motor moves by a formula; torque by virtual work. Both encoders are recorded."""
    both = moved(seed, 20.0)
    motor = both["turn"]
    angle = WAVE * motor.position + PHASE
    ratio = 1.0 + amplitude * WAVE * np.cos(angle)
    speed = ratio * motor.velocity
    acceleration = ratio * motor.acceleration - amplitude * WAVE**2 * np.sin(angle) * motor.velocity**2
    joint = (TURNING - MOTOR) * acceleration + COULOMB["turn"] * np.sign(speed) + VISCOUS["turn"] * speed
    torques = as_modelled(both) | {"turn": MOTOR * motor.acceleration + ratio * joint}
    made = recording(torques, {axis: at.position for axis, at in both.items()}, seed, name)
    return with_joint(made, motor.position + amplitude * np.sin(angle) + 0.3)


def with_joint(made: Recording, position: Array) -> Recording:
    """With an encoder on the joint of `turn`, which counts from a zero of its own."""
    turn = made.columns["turn"] | {"joint_position": np.round(position / 1e-7) * 1e-7}
    return replace(made, columns=made.columns | {"turn": turn})


def test_what_is_compared_of_it_has_no_zero(tmp_path: Path) -> None:
    made = uneven(1)
    rows = compared(tmp_path, made)
    name = deflection_of("turn")
    assert rows.compared == ("turn", "lift", name)
    ahead = rows.target[name]
    assert np.mean(ahead) == pytest.approx(0.0, abs=1e-15)
    assert np.sqrt(np.mean(ahead**2)) == pytest.approx(AMPLITUDE / np.sqrt(2.0), rel=0.1)
    elsewhere = compared(tmp_path, with_joint(made, made.columns["turn"]["joint_position"] + 5.0))
    assert elsewhere.target[name] == pytest.approx(ahead, abs=2e-8)


def test_without_it_in_every_recording_or_with_a_hole_in_it_torque_alone_is_compared(tmp_path: Path) -> None:
    made = uneven(1)
    torn = made.columns["turn"]["joint_position"].copy()
    torn[700] = np.nan
    assert compared(tmp_path, with_joint(made, torn)).compared == ("turn", "lift")
    assert compared(tmp_path, made, strokes(2, 20.0, name="others")).compared == ("turn", "lift")


def test_a_wave_deflects_nothing_where_its_place_is_unknown(tmp_path: Path) -> None:
    """One of two recordings does not know the motor's angle: the other has its deflection as it was."""
    rows = compared(tmp_path, uneven(1, "one"), uneven(2, "two"))
    one, two = rows.runs
    hidden = replace(rows, runs=[one, replace(two, waves_within={"turn": 0.0})])
    wave, dynamics = TransmissionError(AMPLITUDE, ORDER, PHASE), rows.simulation.dynamics()["turn"]
    whole, part = (each.cost("turn", wave, dynamics)[deflection_of("turn")] for each in (rows, hidden))
    run = rows.of["turn"].run
    np.testing.assert_array_equal(part[run == 0], whole[run == 0])
    assert np.abs(whole[run == 1]).max() > 0.5 * AMPLITUDE
    assert not part[run == 1].any()


@pytest.mark.parametrize("deviations", [2.0, 10.0])
def test_energy_that_is_left_knows_no_encoder_read_unusually_far_off(deviations: float, tmp_path: Path) -> None:
    """A deflection that is all timing: none of it is left up to three deviations, and beyond what these do not take."""
    told = ready(tmp_path, uneven(1))
    bench, name = bench_of(told.rows, Settings(), told.absolute), deflection_of("turn")
    (moment,) = (one for one in bench.nominals if one.moment and name in one.column)
    as_it_stands, late = state_of(bench, (), bench.white, {}), moment.spread * moment.column[name]
    state = replace(as_it_stands, target={**as_it_stands.target, name: deviations * late})
    expected = max(0.0, deviations - 3.0) ** 2 * float(late @ late) / bench.rows.gap_energy[name]
    assert state.left[name] == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_a_gear_error_is_found_by_it(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, uneven)
    cause = found.causes[0]
    assert (cause.effect, cause.axis) == ("transmission_error", "turn")
    assert cause.probability > 0.9
    assert cause.indistinguishable_from == ()
    assert cause.parameters["amplitude"].value == pytest.approx(AMPLITUDE, rel=0.02)
    assert cause.parameters["order"].value == ORDER


@pytest.mark.parametrize("settles", [True, False], ids=["settled", "as proposed"])
def test_what_the_encoder_proves_is_no_imitation_of_an_unknown_torque(tmp_path: Path, *, settles: bool) -> None:
    """A gear error that takes all of what the encoder saw, and 2 % of a torque of which the rest has no name."""
    made = uneven(1, amplitude=2e-5)
    turn = made.columns["turn"]
    unknown = 0.8 * np.sin(2.3 * made.time) * np.sin(8.2 * made.time + 1.0)
    made = replace(made, columns=made.columns | {"turn": turn | {"torque": turn["torque"] + unknown}})
    told = ready(tmp_path, made)
    bench = bench_of(told.rows, Settings(), told.absolute)
    nothing = coloured(state_of(bench, (), bench.white, {}), ())
    settled = settled_on(nothing.of((placed(bench.rows, "turn", TransmissionError(2e-5, ORDER, PHASE)),)), 3)
    chosen = settled.effects[0]
    proposer = Proposer(bench, bench, {"turn": [TransmissionError]}, {})
    proposal = proposer.evaluated(nothing, Begun("turn", chosen.effect, 0.0, 1))
    assert proposal is not None
    assert proposal.share < 0.05
    assert proposal.takes > 0.95
    member = replace(proposal, settled=settled) if settles else proposal
    left = {"turn": 0.9, "lift": 0.9}
    answer = weighed(Family(chosen, nothing, [member]), Unexplained(left, left), Settings())
    assert answer.predicts
    assert answer.probability > 0.8
