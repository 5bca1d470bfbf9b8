"""What is held back where nobody gave recordings to validate on: every axis that moves must move there, too."""

from __future__ import annotations

import numpy as np

from drivetwin.diagnosis.prepare.hold_back import hold_back
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo

PERIOD = 0.004
TREMBLE = 1e-5
"""Of an axis that holds its place [rad]: its encoder and its loop never stand quite still."""


def recorded(name: str, lift: float, turn: float, frequency: float) -> Recording:
    """Ten seconds of both axes, swinging so far."""
    time = np.arange(2500, dtype=np.float64) * PERIOD
    swing = np.sin(2.0 * np.pi * frequency * time)
    columns = {axis: {"position": way * swing, "torque": swing} for axis, way in (("lift", lift), ("turn", turn))}
    axes = {axis: AxisInfo(joint=axis) for axis in columns}
    return Recording(name, RecordingInfo(machine="two", sample_period=PERIOD, axes=axes), time, columns)


def travels(part: list[Recording], axis: str) -> float:
    return max(float(np.ptp(one.columns[axis]["position"])) for one in part)


def test_an_axis_that_only_trembles_in_what_would_be_held_back_moves_in_what_is() -> None:
    """Each axis recorded by itself, as `identify` does it: every fourth by speed would hold back the turn's alone."""
    alone = [recorded(f"lift_{k}", 0.3, TREMBLE, 0.1 + 0.01 * k) for k in range(2)]
    alone += [recorded(f"turn_{k}", TREMBLE, 1.0, 0.3 + 0.01 * k) for k in range(3)]
    fitted, held = hold_back(alone, 48.0)
    for part in (fitted, held):
        assert travels(part, "lift") > 0.2
        assert travels(part, "turn") > 0.5


def test_recordings_of_both_axes_are_held_back_whole() -> None:
    both = [recorded(f"both_{k}", 0.3, 1.0, 0.1 + 0.01 * k) for k in range(6)]
    fitted, held = hold_back(both, 48.0)
    assert {len(one.time) for one in (*fitted, *held)} == {2500}
    assert {one.name for one in held} == {"both_2"}
