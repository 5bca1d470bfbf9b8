"""Fifty samples a second: on which side of a reversal one of them was taken is not known, and is no gap."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rig_bench import COULOMB, GEAR, TURNING, VISCOUS, Swing, lift_torque, turn_torque, written_model

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.prepare.rates import fast_enough
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording, RecordingInfo

PERIOD = 0.02
SECONDS = 60.0
LATE = 0.004
"""By which torque is recorded after its position [s]: a fifth of a sample."""


def sines(sizes: tuple[float, float], rates: tuple[float, float], late: float) -> Swing:
    """The sum of two, known exactly."""
    time = np.arange(round(SECONDS / PERIOD), dtype=np.float64) * PERIOD - late
    parts = [(size, 2.0 * np.pi * rate) for size, rate in zip(sizes, rates, strict=True)]
    position = sum(size * np.sin(w * time) for size, w in parts)
    velocity = sum(size * w * np.cos(w * time) for size, w in parts)
    acceleration = sum(-size * w**2 * np.sin(w * time) for size, w in parts)
    return Swing(time, np.asarray(position), np.asarray(velocity), np.asarray(acceleration))


def slow_recording() -> Recording:
    """Of the machine as modelled, without noise."""
    turn, lift = (sines((0.5, 0.2), (0.9, 0.37), late) for late in (0.0, LATE)), sines((0.2, 0.1), (0.3, 0.17), 0.0)
    read, felt = turn
    columns = {
        "turn": {"position": read.position, "torque": turn_torque(felt)},
        "lift": {"position": lift.position, "torque": lift_torque(lift)},
    }
    axes = {axis: {"joint": axis, "actuator": axis, "gear_ratio": GEAR} for axis in columns}
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "column", "sample_period": PERIOD, "axes": axes})
    return Recording("slow", info, np.arange(len(read.time), dtype=np.float64) * PERIOD, columns)


def test_a_reversal_between_two_samples_is_no_gap(tmp_path: Path) -> None:
    """Friction that turns round within a fifth of a sample of where it should; inertia and viscous friction come as late."""
    recorded = slow_recording()
    gap = prepared(written_model(tmp_path), [recorded], [recorded], Settings()).rows.target["turn"]
    swing = sines((0.5, 0.2), (0.9, 0.37), 0.0)
    jerk = np.gradient(swing.acceleration, PERIOD)
    smooth = LATE * float(np.sqrt(np.mean((TURNING * jerk + VISCOUS["turn"] * swing.acceleration) ** 2)))
    assert np.abs(gap).max() < 0.2 * COULOMB["turn"] + 2.0 * smooth


def sampled(name: str, period: float, seconds: float = 10.0) -> Recording:
    axes = {"turn": {"joint": "turn", "actuator": "turn", "gear_ratio": GEAR}}
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "column", "sample_period": period, "axes": axes})
    time = np.arange(round(seconds / period), dtype=np.float64) * period
    return Recording(name, info, time, {"turn": {"position": np.sin(time), "torque": np.cos(time)}})


def test_a_validation_too_slow_for_what_is_fitted_is_left_out_and_said() -> None:
    fitted = [sampled("a", 0.001), sampled("b", 0.0005)]
    slow, fast = sampled("slow", 0.008), sampled("fast", 0.004)
    kept, told = fast_enough(fitted, [slow, fast])
    assert [one.name for one in kept] == ["fast"]
    assert told == ("slow (125 Hz): left out of the validation, for what is fitted was sampled at 1000 Hz or faster.",)


def test_slow_validation_stays_where_little_else_is_there_or_the_fit_is_as_slow() -> None:
    slow, short = sampled("slow", 0.008), sampled("short", 0.001, 2.0)
    assert fast_enough([sampled("a", 0.001)], [slow, short]) == ([slow, short], ())
    assert fast_enough([sampled("a", 0.001)], [slow]) == ([slow], ())
    assert fast_enough([sampled("a", 0.001), sampled("b", 0.008)], [slow, short]) == ([slow, short], ())
    assert fast_enough([sampled("a", 0.001)], []) == ([], ())
