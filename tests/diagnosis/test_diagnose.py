"""Recordings with a cause that a formula of the test put there: the diagnosis names it, its axis and its size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest
from rig_bench import (
    COULOMB,
    GEAR,
    GRAVITY,
    MOTOR,
    PERIOD,
    TURNING,
    VISCOUS,
    Swing,
    Torques,
    as_modelled,
    lift_torque,
    moved,
    recording,
    strokes,
    turn_torque,
    written_model,
)

from diagnosis.diagnose import diagnose
from diagnosis.report.result import Array, Cause, Diagnosis, Verdict
from diagnosis.settings import DiagnosisSettings
from diagnosis.prepare.simulation import simulation
from diagnosis.report.write import write_diagnosis
from drivetwin.recording.recording import Recording
from emulator.effects import read_effects
from emulator.mechanism import Mechanism

SECONDS = 20.0
SERVO_PERIOD = 125e-6
Record = Callable[[int, str], Recording]


@dataclass(frozen=True)
class Case:
    """A machine that has one effect, and the parameters that must come back."""

    effect: str
    axis: str
    record: Record
    parameters: Mapping[str, float]


def with_torque(more: Torques, seed: int, name: str) -> Recording:
    """More torque than modelled, on some axes."""
    return strokes(seed, SECONDS, more, name)


def only(axis: str, more: Callable[[Swing], Array]) -> Record:
    """More torque than modelled on one axis."""
    return partial(with_torque, {axis: more})


def loaded(seed: int, name: str) -> Recording:
    """A point of 0.8 kg on the carriage, 0.6 m from the column's hinge."""
    both = moved(seed, SECONDS)
    torques = as_modelled(both)
    torques["turn"] = torques["turn"] + 0.8 * 0.6**2 * both["turn"].acceleration
    torques["lift"] = torques["lift"] + 0.8 * (GRAVITY + both["lift"].acceleration)
    return recording(torques, {axis: at.position for axis, at in both.items()}, seed, name)


def uneven_gear(seed: int, name: str) -> Recording:
    """The column turns 4 mrad sin(motor's turn + 0.5) more than its motor: the law of virtual work for both."""
    both = moved(seed, SECONDS)
    motor, wave = both["turn"], GEAR * both["turn"].position + 0.5
    ratio = 1.0 + 0.004 * GEAR * np.cos(wave)
    acceleration = ratio * motor.acceleration - 0.004 * GEAR**2 * np.sin(wave) * motor.velocity**2
    turn = Swing(motor.time, motor.position + 0.004 * np.sin(wave), ratio * motor.velocity, acceleration)
    load = turn_torque(turn) - MOTOR * turn.acceleration
    torques = as_modelled(both) | {"turn": MOTOR * motor.acceleration + ratio * load}
    return recording(torques, {"turn": motor.position, "lift": both["lift"].position}, seed, name)


def eccentric_encoder(seed: int, name: str) -> Recording:
    """The column's position is read 4 mrad sin(motor's turn + 0.4) too large."""
    both = moved(seed, SECONDS)
    read = both["turn"].position + 0.004 * np.sin(GEAR * both["turn"].position + 0.4)
    return recording(as_modelled(both), {"turn": read, "lift": both["lift"].position}, seed, name)


def late_encoder(seed: int, name: str) -> Recording:
    """The column's position is read two samples late."""
    both = moved(seed, SECONDS)
    position = both["turn"].position
    read = np.concatenate([np.full(2, position[0]), position[:-2]])
    return recording(as_modelled(both), {"turn": read, "lift": both["lift"].position}, seed, name)


def stribeck(at: Swing) -> Array:
    """0.9 N·m more before it slides."""
    return 0.9 * np.exp(-((at.velocity / 0.15) ** 2)) * np.sign(at.velocity)


STRIBECK = Case("stribeck", "turn", only("turn", stribeck), {"static_torque": COULOMB["turn"] + 0.9, "stribeck_velocity": 0.15})
CASES = (
    STRIBECK,
    Case("spring", "lift", only("lift", lambda at: 40.0 * (at.position - 0.05)), {"stiffness": 40.0, "rest": 0.05}),
    Case("payload", "lift", loaded, {"mass": 0.8}),
    Case("transmission_error", "turn", uneven_gear, {"amplitude": 0.004, "order": 1.0, "phase": 0.5}),
    Case("torque_ripple", "turn", only("turn", lambda at: -0.4 * np.sin(2.0 * GEAR * at.position + 0.7)),
         {"amplitude": 0.4, "order": 2.0, "phase": 0.7}),
    Case("torque_constant", "lift", only("lift", lambda at: lift_torque(at) * -0.1), {"error": 1.0 / 0.9 - 1.0}),
    Case("encoder_eccentricity", "turn", eccentric_encoder, {"amplitude": 0.004, "phase": 0.4}),
    Case("delay", "turn", late_encoder, {"delay": 2.0 * PERIOD}),
)  # fmt: skip
OFF = (
    Case("inertia", "turn", only("turn", lambda at: 0.06 * TURNING * at.acceleration), {"difference": 0.06 * TURNING}),
    Case("coulomb", "lift", only("lift", lambda at: 0.15 * COULOMB["lift"] * np.sign(at.velocity)),
         {"coulomb": 1.15 * COULOMB["lift"]}),
    Case("viscous", "lift", only("lift", lambda at: 0.15 * VISCOUS["lift"] * at.velocity), {"viscous": 1.15 * VISCOUS["lift"]}),
)  # fmt: skip


def diagnosed(folder: Path, record: Record) -> Diagnosis:
    """What is said of one recording, judged on another."""
    return diagnose(
        written_model(folder), [record(1, "fitted")], [record(2, "held")], DiagnosisSettings(), lambda _stage, _share: None
    )


def first(found: Diagnosis) -> Cause:
    """The answer to "which"."""
    assert sum(one.probability for one in found.causes if one.step == 1) == pytest.approx(1.0)
    return found.causes[0]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.effect)
def test_the_effect_is_named_first_on_its_axis_and_in_its_size(case: Case, tmp_path: Path) -> None:
    found = diagnosed(tmp_path, case.record)
    cause = first(found)
    assert (cause.effect, cause.axis) == (case.effect, case.axis)
    assert found.verdict is Verdict.EXPLAINED
    assert [(one.effect.name, one.axis) for one in found.selected] == [(case.effect, case.axis)]
    assert cause.gap_closed is not None
    assert cause.gap_closed.of_explainable > 0.98
    for name, true in case.parameters.items():
        low, high = cause.parameters[name].ci90
        assert cause.parameters[name].value == pytest.approx(true, rel=0.02)
        assert low <= true <= high


def test_a_payload_is_as_far_from_the_hinge_as_it_hangs(tmp_path: Path) -> None:
    """In which direction nothing tells: the column's inertia about its hinge is all that is felt of it."""
    told = first(diagnosed(tmp_path, loaded)).parameters
    assert np.hypot(told["x"].value, told["y"].value) == pytest.approx(0.6, rel=0.01)


@pytest.mark.parametrize("case", OFF, ids=lambda case: case.effect)
def test_a_parameter_of_the_model_that_is_off_is_named_as_what_it_is(case: Case, tmp_path: Path) -> None:
    found = diagnosed(tmp_path, case.record)
    cause = first(found)
    assert (cause.effect, cause.axis) == (case.effect, case.axis)
    assert found.verdict is Verdict.EXPLAINED
    ((name, true),) = case.parameters.items()
    assert cause.parameters[name].value == pytest.approx(true, rel=0.02)


def test_a_sensor_without_noise_hides_nothing(tmp_path: Path) -> None:
    """What is left is far below the comparison's own errors then."""

    def record(seed: int, name: str) -> Recording:
        return strokes(seed, SECONDS, {"turn": lambda at: 0.1 * TURNING * at.acceleration}, name, noise=0.5)

    found = diagnosed(tmp_path, record)
    cause = first(found)
    assert (cause.effect, cause.axis, found.verdict) == ("inertia", "turn", Verdict.EXPLAINED)
    assert cause.parameters["difference"].value == pytest.approx(0.1 * TURNING, rel=0.02)


def test_a_model_four_per_cent_off_in_everything_is_given_no_effect(tmp_path: Path) -> None:
    def more(at: Swing) -> Array:
        friction = COULOMB["turn"] * np.sign(at.velocity) - VISCOUS["turn"] * at.velocity
        return 0.04 * (TURNING * at.acceleration + friction)

    found = diagnosed(tmp_path, only("turn", more))
    assert first(found).effect == "inertia"
    assert {one.effect.name for one in found.selected} <= {"inertia", "coulomb", "viscous"}
    assert {one.axis for one in found.selected} == {"turn"}
    assert found.verdict is Verdict.EXPLAINED


def test_a_sound_machine_has_no_gap(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, partial(with_torque, {}))
    assert found.verdict is Verdict.NO_GAP
    assert (first(found).effect, found.selected) == ("none", ())
    assert not any(one.significant for one in found.axes.values())


def warming(seed: int, name: str, stiffer: float = 0.0) -> Recording:
    """The column's friction is 0.8 larger when cold, for 6 s; the second recording begins 60 s after the first."""
    begin = 60.0 * (seed - 1)

    def more(at: Swing) -> Array:
        cold = 1.0 + 0.8 * np.exp(-(at.time + begin) / 6.0)
        friction = (1.0 + stiffer) * COULOMB["turn"] * np.sign(at.velocity) + VISCOUS["turn"] * at.velocity
        return cold * friction - COULOMB["turn"] * np.sign(at.velocity) - VISCOUS["turn"] * at.velocity

    made = with_torque({"turn": more}, seed, name)
    return replace(made, time=made.time + begin)


def test_a_gap_that_has_died_out_on_the_validation_motion_is_told_of_the_fitted(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, warming)
    cause = first(found)
    assert (cause.effect, cause.axis, found.verdict) == ("temperature_drift", "turn", Verdict.EXPLAINED)
    assert cause.parameters["cold"].value == pytest.approx(0.8, rel=0.03)
    assert cause.gap_closed is None
    told, after = found.told("turn")
    assert found.axes["turn"].significant
    assert told.gap_rms > 5.0 * found.axes["turn"].gap_rms
    assert after < 1.1 * told.noise_rms
    assert [each.recording for each in found.shown_on("turn")] == ["fitted"]
    assert ["turn" in note and "fitted motion only" in note for note in found.notes] == [True]
    assert "on the fitted motion only" in found.axes["turn"].test
    assert not found.axes["lift"].significant


def test_what_is_told_of_the_fitted_motion_is_in_the_order_of_its_time(tmp_path: Path) -> None:
    """The second half given first: friction falls all the same."""
    whole = warming(1, "whole")
    half = len(whole.time) // 2
    late, early = (
        replace(
            whole,
            name=name,
            time=whole.time[span],
            columns={axis: {key: values[span] for key, values in one.items()} for axis, one in whole.columns.items()},
        )
        for name, span in (("late", slice(half, None)), ("early", slice(0, half)))
    )
    model = written_model(tmp_path)
    found = diagnose(model, [late, early], [warming(2, "held")], DiagnosisSettings(), lambda _stage, _share: None)
    assert [each.recording for each in found.shown_on("turn")] == ["early", "late"]
    assert any(one.over == "time" and one.detail.startswith("falls") for one in found.axes["turn"].patterns)


def test_a_warm_level_that_is_off_is_found_beside_the_drift(tmp_path: Path) -> None:
    """Both are moved to where least is left: what is predicted with them is what their fit promised."""
    found = diagnosed(tmp_path, partial(warming, stiffer=0.06))
    assert first(found).effect == "temperature_drift"
    selected = {one.effect.name: one.effect for one in found.selected}
    assert vars(selected["temperature_drift"])["time_constant"] == pytest.approx(6.0, rel=0.05)
    assert vars(selected["coulomb"])["coulomb"] == pytest.approx(1.06 * COULOMB["turn"], rel=0.02)
    assert found.after_rms["turn"] < 1.2 * found.axes["turn"].noise_rms


def test_a_force_that_swings_in_time_is_unknown(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, only("turn", lambda at: 0.8 * np.sin(2.0 * np.pi * 3.7 * at.time)))
    cause = first(found)
    assert (cause.effect, cause.axis, cause.gap_closed) == ("unknown", "turn", None)
    assert (found.verdict, found.selected) == (Verdict.UNEXPLAINED, ())


def test_the_same_recordings_get_the_same_answer(tmp_path: Path) -> None:
    one, other = diagnosed(tmp_path, STRIBECK.record), diagnosed(tmp_path, STRIBECK.record)
    assert replace(one, predictions=()) == replace(other, predictions=())
    for before, again in zip(one.predictions, other.predictions, strict=True):
        np.testing.assert_array_equal(before.axes["turn"].after, again.axes["turn"].after)


def test_the_patched_simulation_moves_as_measured_under_the_torque_that_is_predicted(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, STRIBECK.record)
    out = tmp_path / "out"
    out.mkdir()
    write_diagnosis(found, [tmp_path / "column.xml"], out, html=False)
    told, plain = found.predictions[0].axes["turn"], found.predictions[0].axes["lift"]
    sliding = told.used & (np.abs(told.velocity) > 0.05) & (np.abs(plain.velocity) > 0.05)
    rows = np.flatnonzero(sliding & (np.abs(told.velocity) < 0.3))[::5]
    assert len(rows) > 30
    mechanism = _mechanism(out)
    accelerations = np.array([_accelerated(mechanism, found, row) for row in rows])
    error = TURNING * (accelerations - told.acceleration[rows])
    level = TURNING * 0.9 * np.exp(-((told.velocity[rows] / 0.15) ** 2))
    assert np.sqrt(np.mean(error**2)) < 0.05 * np.sqrt(np.mean(level**2))


def _mechanism(out: Path) -> Mechanism:
    """What the emulator makes of patched.xml and effects.json."""
    spec = mujoco.MjSpec.from_file(str(out / "patched.xml"))
    spec.option.timestep = SERVO_PERIOD
    axes = strokes(1, SECONDS).info.axes
    return Mechanism(spec, simulation(out / "patched.xml", axes).drives, read_effects(out / "effects.json"))


def _accelerated(mechanism: Mechanism, found: Diagnosis, row: int) -> float:
    """Of the column, after two servo periods from the measured state under the torques predicted after the patch."""
    axes = found.predictions[0].axes.values()
    mechanism.data.qpos[:] = [axis.position[row] for axis in axes]
    mechanism.data.qvel[:] = [axis.velocity[row] for axis in axes]
    for _ in range(2):
        mechanism.read()
        mechanism.motor_torque[:] = [axis.after[row] / GEAR for axis in axes]
        mechanism.step()
    return float((mechanism.joint_velocities()[0] - found.predictions[0].axes["turn"].velocity[row]) / (2.0 * SERVO_PERIOD))
