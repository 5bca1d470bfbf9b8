"""MuJoCo, called without Python in between."""

from __future__ import annotations

import mujoco

from drivetwin.foundation.mujoco_calls import stop_clocks


def test_no_clock_runs_in_a_step() -> None:
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = mujoco.MjData(model)
    stop_clocks()
    mujoco.mj_step(model, data)
    assert data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration == 0.0
