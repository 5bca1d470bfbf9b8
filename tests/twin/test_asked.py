"""Torque that loops demanded, from demand and position alone, against the force that MuJoCo's own actuators gave."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from replay_bench import KI, KP, KV, MOTOR, PERIOD, PID, SERVO, STEP, Array, demand, recording, write_model

from drivetwin.foundation.errors import UserError
from drivetwin.motion.filtering import zero_phase
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_recording
from drivetwin.twin.asked import asked, loops_by_position

COUNT = 3000
GAINS = {"servo_period": STEP, "proportional_gain": KP, "derivative_gain": KV}
CASCADE = {"position_gain": 12.0, "velocity_gain": KV, "integral_time": 0.05, "servo_period": STEP}


def by_a_smooth_demand(model: Path) -> Recording:
    """What MuJoCo's own actuator makes of a demand that has no corners between the rows, a millisecond each."""
    compiled = mujoco.MjModel.from_xml_path(str(model))
    data = mujoco.MjData(compiled)
    rows = round(PERIOD / STEP)
    fine = demand((COUNT - 1) * rows + 1, STEP)
    slope = np.diff(fine, prepend=fine[0]) / STEP
    position, torque = np.empty((2, COUNT))
    for tick, target in enumerate(fine):
        data.ctrl[:] = (target, slope[tick], 0.0)[: compiled.nu]
        at = float(data.qpos[0])
        mujoco.mj_step(compiled, data)
        if tick % rows == 0:
            position[tick // rows], torque[tick // rows] = at, float(data.actuator_force[0])
    return recording({"position": position, "torque": torque, "position_demand": fine[::rows]})


def slow(torque: Array) -> Array:
    """As a diagnosis compares it, without the ends of the filter."""
    return zero_phase(torque, PERIOD, 30.0)[100:-100]


def without_torque(measured: Recording, drive: dict[str, Any] | None) -> Recording:
    columns = {name: values for name, values in measured.columns["turn"].items() if name != "torque"}
    return recording(columns, drive)


@pytest.mark.parametrize(
    ("drive", "actuator"),
    [
        (None, SERVO),
        ({"law": "pd_position_servo", **GAINS}, SERVO),
        ({"law": "pid", "integral_gain": KI, **GAINS}, PID),
        (  # a PI velocity loop in a P position loop is a PID of kv (P + 1/T) and kv P/T
            CASCADE,
            PID.replace(f'kp="{KP}"', f'kp="{KV * (12.0 + 20.0)}"').replace(f'ki="{KI}"', f'ki="{KV * 12.0 * 20.0}"'),
        ),
    ],
    ids=["actuator of the model", "pd position servo", "pid", "cascade"],
)
def test_it_is_the_force_of_mujocos_actuator(drive: dict[str, Any] | None, actuator: str, tmp_path: Path) -> None:
    measured = by_a_smooth_demand(write_model(tmp_path, actuator))
    log = without_torque(measured, drive)
    model = read_mjcf(write_model(tmp_path, SERVO if drive is None else MOTOR))
    found, given = slow(asked(log, "turn", loops_by_position(log, "turn", model))), slow(measured.columns["turn"]["torque"])
    if drive is not None and drive.get("law") != "pd_position_servo":  # what the integral held at the start is not known
        found, given = found - found.mean(), given - given.mean()
    assert np.std(found - given) < 0.01 * np.std(given)


def test_a_drive_that_follows_a_torque_asks_for_none(tmp_path: Path) -> None:
    log = without_torque(by_a_smooth_demand(write_model(tmp_path, SERVO)), {"law": "torque"})
    with pytest.raises(UserError, match="axis turn: no torque was recorded, so that it has to follow from position_demand"):
        loops_by_position(log, "turn", read_mjcf(write_model(tmp_path, SERVO)))


def test_loops_that_nobody_tells_are_asked_for(tmp_path: Path) -> None:
    log = without_torque(by_a_smooth_demand(write_model(tmp_path, SERVO)), None)
    with pytest.raises(UserError, match=r"axis turn: no torque was recorded.*: no loop is known"):
        loops_by_position(log, "turn", read_mjcf(write_model(tmp_path, MOTOR)))


def test_a_gain_that_is_missing_is_missed_in_the_file_where_it_belongs(tmp_path: Path) -> None:
    log = without_torque(by_a_smooth_demand(write_model(tmp_path, SERVO)), {"law": "cascade", "position_gain": 30.0})
    write_recording(log, tmp_path / "log")
    [read] = read_recording(tmp_path / "log")
    with pytest.raises(UserError, match=r"^\S*recording\.json: axis turn: no torque was recorded.*velocity_gain"):
        loops_by_position(read, "turn", read_mjcf(write_model(tmp_path, MOTOR)))
