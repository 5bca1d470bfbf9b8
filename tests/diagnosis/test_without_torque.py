"""A servo that logs command and position only, moved by MuJoCo alone: what is found by them, and what is said not to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare import rows as of_rows
from drivetwin.diagnosis.prepare.inputs import read_inputs
from drivetwin.diagnosis.prepare.lead import likeliest
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.propose.nominal import nominal_parameters
from drivetwin.diagnosis.report.closed_loop import in_closed_loop
from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Recording, RecordingInfo
from drivetwin.recording.writer import write_recording
from drivetwin.twin.comparison import MODEL as ALONE
from drivetwin.twin.comparison import WITH_EFFECTS

PERIOD, STEP, SECONDS = 0.01, 0.0005, 12.0
COULOMB, DAMPING, ARMATURE = 0.12, 0.1, 0.01
MODEL = """<mujoco><option timestep="{step}" integrator="implicitfast"/><worldbody><body>
<joint name="shoulder" axis="0 1 0" damping="{damping}" frictionloss="{coulomb}" armature="{armature}"/>
<inertial pos="{lean} 0 -0.12" mass="0.4" diaginertia="0.002 0.002 0.002"/></body></worldbody>
<actuator>{actuator}</actuator></mujoco>"""
AS_MODELLED: Mapping[str, float] = {}
SERVO = '<position name="shoulder" joint="shoulder" kp="18" kv="0.6"/>'
MOTOR = '<motor name="shoulder" joint="shoulder"/>'


INTEGRAL = 3.0
PID = {"law": "pid", "proportional_gain": 18.0, "integral_gain": INTEGRAL, "derivative_gain": 0.6, "velocity_feedforward": 0.0}


def mjcf(actuator: str = SERVO, *, coulomb: float = COULOMB, damping: float = DAMPING, armature: float = ARMATURE,
         lean: float = 0.0) -> str:  # fmt: skip
    return MODEL.format(step=STEP, actuator=actuator, coulomb=coulomb, damping=damping, armature=armature, lean=lean)


def commanded(seed: int, time: Array) -> Array:
    """Three sines of slow, middling and fast motion."""
    rng = np.random.default_rng(seed)
    waves = zip((0.25, 0.8, 1.9), (0.6, 0.3, 0.12), rng.uniform(0.0, 2.0 * np.pi, 3), strict=True)
    return np.asarray(sum(size * np.sin(2.0 * np.pi * often * time + phase) for often, size, phase in waves))


def logged(
    seed: int, *, drive: Mapping[str, Any] | None = None, name: str = "log", truth: Mapping[str, float] = AS_MODELLED
) -> Recording:
    """What a position actuator of a plain MuJoCo loop makes of the command, 100 rows a second, 12 bits a turn.

    With an integral beside it where the drive's `law` is PID.
    """
    integral = INTEGRAL if drive is not None and drive["law"] == "pid" else 0.0
    model = mujoco.MjModel.from_xml_string(mjcf(SERVO, **truth))
    data = mujoco.MjData(model)
    time: Array = np.arange(round(SECONDS / PERIOD), dtype=np.float64) * PERIOD
    rows = round(PERIOD / STEP)
    fine = commanded(seed, np.arange(len(time) * rows, dtype=np.float64) * STEP)
    data.qpos[0] = fine[0]
    position = np.empty(len(time))
    for tick, target in enumerate(fine):
        data.ctrl[0] = target
        if tick % rows == 0:
            position[tick // rows] = float(data.qpos[0])
        data.qfrc_applied[0] += STEP * integral * (target - data.qpos[0])
        mujoco.mj_step(model, data)
    count = 2.0 * np.pi / 4096.0
    columns = {"position": np.round(position / count) * count, "position_demand": fine[::rows]}
    axis = {"joint": "shoulder", "actuator": "shoulder", "position_resolution": count} | ({"drive": drive} if drive else {})
    told = {"schema": "recording/2", "machine": "arm", "sample_period": PERIOD, "axes": {"shoulder": axis}}
    return Recording(name, RecordingInfo.model_validate(told), time, {"shoulder": columns})


def written(folder: Path, actuator: str = SERVO) -> Path:
    path = folder / "arm.xml"
    path.write_text(mjcf(actuator), encoding="utf-8")
    return path


@cache
def _logs(**truth: float) -> tuple[Recording, Recording]:
    return logged(1, name="fitted", truth=truth), logged(2, name="held", truth=truth)


def diagnosed(folder: Path, **truth: float) -> Diagnosis:
    fitted, held = _logs(**truth)
    return diagnose(written(folder), [fitted], [held], Settings(), lambda _stage, _share: None)


@pytest.mark.parametrize(
    ("effect", "parameter", "truth", "value"),
    [
        ("coulomb", "coulomb", {"coulomb": 0.25}, 0.25),
        ("viscous", "viscous", {"damping": 0.25}, 0.25),
        ("inertia", "difference", {"armature": 0.016}, 0.006),
    ],
)
def test_what_differs_is_found(effect: str, parameter: str, truth: dict[str, float], value: float, tmp_path: Path) -> None:
    found = diagnosed(tmp_path, **truth)
    first = found.causes[0]
    assert (first.effect, first.axis) == (effect, "shoulder")
    assert first.parameters[parameter].value == pytest.approx(value, rel=0.15)
    (replayed,) = in_closed_loop(found, tmp_path / "arm.xml").closed_loop
    runs = replayed.axes["shoulder"].runs
    assert runs[WITH_EFFECTS].apart["position"].rms < 0.5 * runs[ALONE].apart["position"].rms


def test_a_machine_as_modelled_has_no_gap(tmp_path: Path) -> None:
    assert diagnosed(tmp_path).verdict == "no_gap"


def ready(folder: Path, drive: dict[str, Any] | None, actuator: str) -> Prepared:
    log = logged(1, drive=drive)
    return prepared(written(folder, actuator), [log], [log], Settings())


def refused(made: Prepared) -> dict[str, str]:
    return {one.effect: one.reason for one in made.testable["shoulder"].not_testable}


def test_it_says_what_only_a_torque_would_tell(tmp_path: Path) -> None:
    by_model = ready(tmp_path, None, SERVO)
    assert {"current_bandwidth", "torque_saturation", "torque_constant"} <= set(refused(by_model))
    assert "torque_offset" not in refused(by_model)
    needed = {one.needed for one in by_model.testable["shoulder"].not_testable if one.effect == "torque_saturation"}
    assert needed == {"the torque that the drive gives: `torque`"}
    told = "shoulder: no torque was recorded. The comparison uses the torque that the position actuator"
    assert [note.startswith(told) for note in by_model.notes].count(True) == 1


def test_an_integral_hides_any_constant(tmp_path: Path) -> None:
    made = ready(tmp_path, PID, MOTOR)
    assert "integral" in refused(made)["torque_offset"]
    assert "torque_constant" not in refused(made)


def test_a_torque_has_its_share_where_an_integral_hides_its_mean(tmp_path: Path) -> None:
    """A centre of mass beside the arm's line: its weight has a mean that the integral holds, and that no gap has."""
    fitted, held = (logged(seed, drive=PID, name=name, truth={"lean": 0.12}) for seed, name in ((1, "fitted"), (2, "held")))
    found = diagnose(written(tmp_path, MOTOR), [fitted], [held], Settings(), lambda _stage, _share: None)
    assert found.causes[0].effect in {"gravity", "payload"}
    assert found.causes[0].share > 0.8


SERVO_PERIOD = 0.002
POSITION_GAIN, VELOCITY_GAIN, INTEGRAL_TIME = 20.0, 1.5, 0.05
CASCADE = {
    "law": "cascade",
    "position_gain": POSITION_GAIN,
    "velocity_gain": VELOCITY_GAIN,
    "integral_time": INTEGRAL_TIME,
    "servo_period": SERVO_PERIOD,
}


def by_cascade(lead: float, seed: int, armature: float) -> Recording:
    """What a cascade of backward differences makes of the command, the demand's rate so many servo periods ahead of its own."""
    model = mujoco.MjModel.from_xml_string(mjcf(MOTOR, armature=armature))
    data = mujoco.MjData(model)
    ticks = round(SECONDS / SERVO_PERIOD)
    demand = commanded(seed, np.arange(-1, ticks + 1, dtype=np.float64) * SERVO_PERIOD)
    steps = np.diff(demand) / SERVO_PERIOD
    rate = (1.0 - lead) * steps[:-1] + lead * steps[1:]
    data.qpos[0] = demand[1]
    data.qvel[0] = rate[0]
    position, held = np.empty(ticks), 0.0
    before = demand[0]
    for tick, target in enumerate(demand[1:-1]):
        position[tick] = now = float(data.qpos[0])
        wanted = POSITION_GAIN * (target - now) + rate[tick] - (now - before) / SERVO_PERIOD
        held += wanted * SERVO_PERIOD / INTEGRAL_TIME
        data.ctrl[0] = VELOCITY_GAIN * (wanted + held)
        before = now
        mujoco.mj_step(model, data, nstep=round(SERVO_PERIOD / STEP))
    columns = {"position": position, "position_demand": demand[1:-1]}
    axis = {"joint": "shoulder", "actuator": "shoulder", "position_resolution": 1e-7, "drive": CASCADE}
    told = {"schema": "recording/2", "machine": "arm", "sample_period": SERVO_PERIOD, "axes": {"shoulder": axis}}
    time: Array = np.arange(ticks, dtype=np.float64) * SERVO_PERIOD
    return Recording("log", RecordingInfo.model_validate(told), time, {"shoulder": columns})


ZERO = 0.8
"""Of a position that counts from its own zero [rad]."""


def test_a_zero_is_found_where_an_integral_holds_a_constant(tmp_path: Path) -> None:
    log = by_cascade(0.5, 1, ARMATURE)
    axes = {"shoulder": log.info.axes["shoulder"].model_copy(update={"position_relative": True})}
    columns = {"shoulder": {name: values - ZERO for name, values in log.columns["shoulder"].items()}}
    relative = replace(log, info=log.info.model_copy(update={"axes": axes}), columns=columns)
    made = prepared(written(tmp_path, MOTOR), [relative], [relative], Settings())
    moved_by = made.runs[0].recording.columns["shoulder"]["position"] - columns["shoulder"]["position"]
    assert np.mean(moved_by) == pytest.approx(ZERO, abs=0.02)
    own = made.runs[0].axes["shoulder"]
    left = (own.torque - own.base)[own.used]
    assert abs(np.mean(left)) < 0.01 * np.std(own.torque)


@pytest.mark.parametrize("armature", [ARMATURE, 2.0 * ARMATURE], ids=["as modelled", "more inertia"])
@pytest.mark.parametrize("lead", [0.0, 0.5, 1.0])
def test_the_rate_of_the_demand_is_taken_when_the_drive_took_it(lead: float, armature: float, tmp_path: Path) -> None:
    log = by_cascade(lead, 1, armature)
    made = prepared(written(tmp_path, MOTOR), [log], [log], Settings())
    drive = made.runs[0].recording.info.axes["shoulder"].drive
    assert drive is not None
    assert drive.velocity_feedforward_lead == pytest.approx(lead * SERVO_PERIOD)


def test_a_share_that_is_large_is_found_where_the_prior_alone_would_hold_it_at_none() -> None:
    """Of one column and twelve values, beside the best share of a fine grid."""
    rng = np.random.default_rng(0)
    column = rng.standard_normal(500)
    rows, shares = 12.0 * column + 0.1 * rng.standard_normal(500), np.linspace(-2.0, 20.0, 200_001)
    left = np.sum(rows**2) - 2.0 * shares * (column @ rows) + shares**2 * (column @ column)
    best = np.max(-6.0 * np.log(left) - 2.5 * np.log1p(shares**2 / 4.0))
    assert likeliest(column[:, None], rows, 12.0, 4.0) == pytest.approx(best, abs=1e-6)


def test_what_an_integral_held_is_one_constant_of_a_recording_however_many_pieces_of_it_are_searched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = ready(tmp_path, PID, MOTOR).rows
    monkeypatch.setattr(of_rows, "SEARCHED", sum(len(run.recording.time) for run in rows.runs) // 2)
    monkeypatch.setattr(of_rows, "PIECE", 2.0)
    pieces = replace(rows).searched
    assert len(pieces.runs) > len(rows.runs)
    assert len(nominal_parameters(pieces, Settings())) == len(nominal_parameters(rows, Settings()))


def test_a_log_without_known_loops_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"axis shoulder: no torque was recorded.*: no loop is known.*write `drive`"):
        ready(tmp_path, None, MOTOR)


def test_the_reader_takes_such_a_log(tmp_path: Path) -> None:
    write_recording(logged(1), tmp_path / "log")
    read = read_inputs(written(tmp_path), [tmp_path / "log"], [], cutoff_hz=None, allow_gaps=False)
    assert set(read.training[0].columns["shoulder"]) == {"position", "position_demand"}
