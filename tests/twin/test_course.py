"""The steps of a replay and the demand at each: those of the drive, as recording.json tells them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from drivetwin.emulator.drive.servo import POSITION
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import AxisInfo, DriveLoops, Interpolation, Recording, RecordingInfo
from drivetwin.twin.course import as_interpolated, course_of, grid_of
from drivetwin.twin.loops import loops_of


def told(period: float | None) -> Recording:
    axis = AxisInfo(joint="x", drive=DriveLoops(position_gain=1.0, servo_period=period))
    info = RecordingInfo(machine="bench", sample_period=1e-3, axes={"x": axis})
    return Recording("strokes", info, np.asarray(np.arange(10) * 1e-3, dtype=np.float64), {"x": {"position": np.zeros(10)}})


@pytest.mark.parametrize("period", [1e-300, 1e-12, 0.9e-6])
def test_a_servo_period_that_no_drive_has_is_refused(period: float) -> None:
    """A millisecond is 10^9 steps of 1e-12 s."""
    with pytest.raises(UserError, match=r"strokes: axes\.x\.drive\.servo_period is .* s; expected 1e-06 s or more"):
        grid_of(told(period))


@pytest.mark.parametrize(("period", "steps"), [(None, 8), (0.0, 8), (1e-3, 8), (62.5e-6, 16), (1e-6, 1000)])
def test_a_row_is_whole_steps_of_the_servo_period_or_of_125_us(period: float | None, steps: int) -> None:
    grid = grid_of(told(period))
    assert grid.row == steps
    assert grid.step == pytest.approx(1e-3 / steps)


MOST = {None: 1e-4, Interpolation.LINEAR: 1e-4, Interpolation.CUBIC_SPLINE: 2e-8}
BODY = mujoco.MjModel.from_xml_string('<mujoco><worldbody><body><joint name="x"/><geom size="1"/></body></worldbody></mujoco>')


@pytest.mark.parametrize("interpolation", MOST)
def test_a_demand_goes_on_between_rows_as_the_drive_says(interpolation: Interpolation | None) -> None:
    """A sine of 20 rad/s at 250 rows a second: a line is (w T)² / 8 short of it, a spline 5 (w T)⁴ / 384."""
    time = np.asarray(np.arange(500) * 4e-3, dtype=np.float64)
    drive = DriveLoops(position_gain=1.0, velocity_gain=1.0, interpolation=interpolation)
    info = RecordingInfo(machine="bench", sample_period=4e-3, axes={"x": AxisInfo(joint="x", drive=drive)})
    swing = 0.1 * np.sin(20.0 * time)
    recording = Recording("swing", info, time, {"x": {"position": swing, "position_demand": swing, "torque": swing}})
    grid, loops = grid_of(recording), loops_of("swing", info.axes["x"], BODY)
    course = course_of("swing", recording, "x", loops, grid, as_interpolated(recording, "x"))
    asked, true = course.demand[:, POSITION], 0.1 * np.sin(20.0 * grid.rows(len(time)) * 4e-3)
    assert 0.5 * MOST[interpolation] < np.abs(asked - true)[100:-100].max() < MOST[interpolation]
