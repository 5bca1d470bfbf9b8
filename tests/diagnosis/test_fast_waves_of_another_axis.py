"""An encoder error of one axis that passes faster than a log has samples: what the drive of the axis below gives for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import AxisEffect, PlacedEffect
from drivetwin.emulator.effects.encoder_eccentricity import EncoderEccentricity
from drivetwin.emulator.effects.transmission_error import TransmissionError
from drivetwin.recording.recording import Recording, RecordingInfo
from drivetwin.twin.replay import replay

GEAR, FINE, SLOW = 400.0, 1e-3, 20
"""Of the upper axis [rad/m]; periods of the closed loop [s], and how many of them the log has one sample of."""
MODEL = f"""<mujoco model="carts"><option gravity="0 0 0"/><worldbody>
<body><joint name="lower" type="slide" axis="1 0 0" damping="2"/><inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/>
<body><joint name="upper" type="slide" axis="1 0 0" damping="4"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
</body></body></worldbody>
<actuator><motor name="lower" joint="lower"/><motor name="upper" joint="upper" gear="{GEAR}"/></actuator></mujoco>"""
GAINS = {"lower": 700.0, "upper": 200.0}
"""Of velocity [N s/m]: both drives are as fast."""


def recorded(
    period: float, columns: dict[str, dict[str, np.ndarray[tuple[int, ...], np.dtype[np.float64]]]], gains: dict[str, float]
) -> Recording:
    drive = {"position_gain": 30.0, "integral_time": 0.1, "servo_period": 2.5e-4, "velocity_filter_hz": 500.0}
    axes: dict[str, Any] = {
        axis: {"joint": axis, "actuator": axis, "gear_ratio": ratio, "drive": {**drive, "velocity_gain": gains[axis]}}
        for axis, ratio in (("lower", 1.0), ("upper", GEAR))
    }
    info = RecordingInfo.model_validate({"schema": "recording/2", "machine": "carts", "sample_period": period, "axes": axes})
    count = len(columns["upper"]["position"])
    return Recording("strokes", info, np.arange(count, dtype=np.float64) * period, columns)


def left_by(wave: AxisEffect, speed: float, folder: Path, lower: float = GAINS["lower"]) -> dict[str, float]:
    """Of the energy of each axis's gap, the share that the true effect of the upper one leaves, at a share of full speed.

    `lower`: gain of the other drive.
    """
    path = folder / "carts.xml"
    path.write_text(MODEL, encoding="utf-8")
    time = np.arange(round(24.0 / FINE)) * FINE
    demands = {"lower": 0.3 * np.sin(0.9 * time), "upper": speed * (0.6 * np.sin(0.5 * time) + 0.3 * np.sin(2.4 * time))}
    asked = {axis: {"position": own, "torque": np.zeros_like(time), "position_demand": own} for axis, own in demands.items()}
    gains = GAINS | {"lower": lower}
    runs = replay(path, recorded(FINE, asked, gains), (PlacedEffect("upper", wave, {}),))
    columns = {
        axis: {"position": run.position[::SLOW], "torque": run.torque[::SLOW], "position_demand": demands[axis][::SLOW]}
        for axis, run in runs.items()
    }
    log = recorded(SLOW * FINE, columns, gains)
    ready = prepared(path, [log], [log], Settings())
    (run,), found = ready.runs, {}
    for axis, felt in run.cost("upper", wave, ready.simulation.dynamics()["upper"]).items():
        own = run.axes[axis]
        gap = (own.torque - own.base)[own.used]
        found[axis] = float(np.mean((gap - felt[own.used]) ** 2) / np.mean(gap**2))
    return found


def encoder(amplitude: float) -> AxisEffect:
    return EncoderEccentricity(amplitude, 0.7)


def gear(amplitude: float) -> AxisEffect:
    return TransmissionError(amplitude, 1.0, 0.7)


@pytest.mark.parametrize("lower", [250.0, 700.0, 1400.0])
@pytest.mark.parametrize("made", [encoder, gear])
def test_what_passes_faster_than_the_samples_is_felt_as_the_drives_of_both_axes_make_it(
    made: Callable[[float], AxisEffect], lower: float, tmp_path: Path
) -> None:
    """Waves of up to 76 Hz in 50 samples a second, with a drive below that is a third, as and twice as fast. What the
    samples show of them would leave 1.1 to 1.6 of the lower axis's gap, the whole wave five times that.
    """
    left = left_by(made(2e-5), 1.0, tmp_path, lower)
    assert left["upper"] < 0.3
    assert left["lower"] < 0.3


@pytest.mark.parametrize("made", [encoder, gear])
def test_what_the_samples_show_is_felt(made: Callable[[float], AxisEffect], tmp_path: Path) -> None:
    """Waves of up to 15 Hz."""
    left = left_by(made(2e-4), 0.2, tmp_path)
    assert left["upper"] < 0.05
    assert left["lower"] < 0.2
