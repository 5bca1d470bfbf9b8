"""What a drive's loops give against a torque that disturbs the axis, against MuJoCo's own PID actuator."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from replay_bench import INERTIA, KI, KP, KV, PID, STEP, write_model

from drivetwin.recording.recording import DriveLoops
from drivetwin.twin.loops import told_loops

SETTLED = 4.0
"""After which no start is seen [s]."""


def given(folder: Path, frequency: float) -> complex:
    """Share of a sine of 1 N·m on the joint that the actuator gives against it, from whole periods after it has settled."""
    model = mujoco.MjModel.from_xml_path(str(write_model(folder, PID, damping=0.0, coulomb=0.0)))
    data = mujoco.MjData(model)
    whole = round(max(8.0, frequency) / frequency / STEP)
    time, force = np.empty((2, round(SETTLED / STEP) + whole))
    for k in range(len(time)):
        time[k] = data.time
        data.qfrc_applied[0] = np.sin(2.0 * np.pi * frequency * data.time)
        mujoco.mj_step(model, data)
        force[k] = data.actuator_force[0]
    line = np.exp(-2j * np.pi * frequency * time[-whole:])
    return complex(-2j * np.mean(force[-whole:] * line))


@pytest.mark.parametrize("frequency", [1.0, 4.0, 12.0, 40.0])
def test_loops_give_against_a_sine_what_mujocos_pid_gives(tmp_path: Path, frequency: float) -> None:
    drive = DriveLoops.model_validate(
        {"law": "pid", "proportional_gain": KP, "integral_gain": KI, "derivative_gain": KV, "servo_period": STEP}
    )
    loops = told_loops("drive", drive)
    assert loops is not None
    share = loops.answer(np.array([frequency]), INERTIA)[0]
    assert abs(share - given(tmp_path, frequency)) < 0.03 * abs(share)
