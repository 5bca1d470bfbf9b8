"""The steps of a replay: those of the drive, as recording.json tells its servo period."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import AxisInfo, DriveLoops, Recording, RecordingInfo
from drivetwin.twin.course import grid_of


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
