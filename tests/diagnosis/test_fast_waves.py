"""Cogging and errors of encoder and gear that pass faster than a log has samples: what the drive's loops give against them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.sampling import Sampling
from drivetwin.emulator.effects import AxisEffect, PlacedEffect
from drivetwin.emulator.effects.encoder_eccentricity import EncoderEccentricity
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.transmission_error import TransmissionError
from drivetwin.recording.recording import Recording, RecordingInfo
from drivetwin.twin.replay import replay

GEAR, FINE, SLOW = 100.0, 1e-3, 20
RIPPLE = TorqueRipple(0.4, 6.0, 0.7)
MODEL = """<mujoco model="turn"><option gravity="0 0 0"/><worldbody><body><joint name="turn" axis="0 0 1" damping="0.2"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.2 0.2 0.2"/></body></worldbody>
<actuator><motor name="turn" joint="turn" gear="100"/></actuator></mujoco>"""
DRIVE = {
    "position_gain": 30.0,
    "velocity_gain": 40.0,
    "integral_time": 0.1,
    "servo_period": 2.5e-4,
    "velocity_filter_hz": 500.0,
}


def recorded(period: float, columns: dict[str, np.ndarray[tuple[int, ...], np.dtype[np.float64]]], **told: Any) -> Recording:
    axis = {"joint": "turn", "actuator": "turn", "gear_ratio": GEAR, "drive": DRIVE} | told
    info = {"schema": "recording/2", "machine": "turn", "sample_period": period, "axes": {"turn": axis}}
    time = np.arange(len(columns["position_demand"]), dtype=np.float64) * period
    return Recording("strokes", RecordingInfo.model_validate(info), time, {"turn": columns})


def made(folder: Path, late: float = 0.0, drive: Any = DRIVE, wave: AxisEffect = RIPPLE, travel: float = 1.0) -> Prepared:
    """Fifty samples a second of strokes at which a wave passes with up to 76 Hz, from a closed loop in MuJoCo.

    Its torque comes `late` [s], and the recording says so; it may say that other loops are the `drive`'s.
    """
    path = folder / "turn.xml"
    path.write_text(MODEL, encoding="utf-8")
    time = np.arange(round(24.0 / FINE)) * FINE
    demand = travel * (0.4 * np.sin(0.5 * time) + 0.25 * np.sin(2.4 * time))
    demanded = recorded(FINE, {"position": demand, "torque": np.zeros_like(time), "position_demand": demand})
    run = replay(path, demanded, (PlacedEffect("turn", wave, {}),))["turn"]
    columns = {"position": run.position, "torque": np.roll(run.torque, round(late / FINE)), "position_demand": demand}
    told = {"torque_delay": late or None, "drive": drive}
    log = recorded(SLOW * FINE, {name: samples[::SLOW] for name, samples in columns.items()}, **told)
    return prepared(path, [log], [log], Settings())


def left(made: Prepared, *, answered: bool, wave: AxisEffect = RIPPLE) -> float:
    """Of the gap's energy, the share that the wave leaves."""
    (run,) = made.runs
    own = run.axes["turn"]
    if not answered:
        own = replace(own, motion=replace(own.motion, sampling=None))
        run = replace(run, axes={"turn": own})
    gap = (own.torque - own.base)[own.used]
    cost = run.cost("turn", wave, made.simulation.dynamics()["turn"])["turn"][own.used]
    return float(np.mean((gap - cost) ** 2) / np.mean(gap**2))


@pytest.mark.parametrize(("late", "most"), [(0.0, 0.03), (0.004, 0.1)], ids=["at once", "4 ms late"])
def test_a_slow_log_shows_of_a_cogging_what_the_loops_give_against_it(tmp_path: Path, late: float, most: float) -> None:
    log = made(tmp_path, late)
    assert left(log, answered=True) < most
    assert left(log, answered=False) > 0.4


@pytest.mark.parametrize(
    ("wave", "travel"),
    [(EncoderEccentricity(1e-4, 0.7), 6.0), (TransmissionError(2e-5, 6.0, 0.7), 1.0)],
    ids=["of the encoder", "of the gear"],
)
def test_so_it_does_of_an_error_of_encoder_or_gear(tmp_path: Path, wave: AxisEffect, travel: float) -> None:
    """The loops see it as a motion, and give against it what they would give against the torque of that."""
    log = made(tmp_path, wave=wave, travel=travel)
    assert left(log, answered=True, wave=wave) < 0.06
    assert left(log, answered=False, wave=wave) > 0.4


def test_an_acceleration_that_the_filter_passes_in_part_is_known_in_part(tmp_path: Path) -> None:
    """Waves of up to 17 Hz, of a log of 50 Hz: half a period lasts little more than one and a half samples."""
    wave = EncoderEccentricity(1e-3, 0.7)
    log = made(tmp_path, wave=wave, travel=1.3)
    assert left(log, answered=True, wave=wave) < 0.012
    assert left(log, answered=False, wave=wave) > 0.03


@pytest.mark.parametrize(
    ("gains", "known"),
    [({}, True), ({"velocity_gain": 0.004}, False), ({"velocity_gain": 1e-3, "position_gain": 3e7}, False)],
    ids=["as they are", "of the motor", "without damping"],
)
def test_loops_that_are_not_the_drives_say_nothing_of_a_wave(tmp_path: Path, gains: dict[str, float], *, known: bool) -> None:
    """The law with gains of another unit does not give the recorded torque; without damping it would ring."""
    log = made(tmp_path, drive=DRIVE | gains)
    assert (log.runs[0].axes["turn"].motion.sampling is not None) == known


def moving(speed: float, period: float, sampling: Sampling) -> Motion:
    time = np.arange(200, dtype=np.float64) * period
    still = np.zeros_like(time)
    steady = np.full_like(time, speed)
    return Motion(speed * time, steady, still, still, time, still, still + 1.0, 0.0, sampling=sampling)


def answered(share: float) -> Sampling:
    """Of a hundred samples a second, where the loops give a share of every torque."""
    return Sampling(0.01, lambda frequency: np.full(len(frequency), complex(share)), 20.0, 1.0)


def test_a_body_that_the_model_lacks_feels_as_much_of_the_wave_as_one_that_it_has() -> None:
    """An inertia as large as the model's doubles what the drive gives for the error of its encoder."""
    motion, axis = moving(1.0, 0.01, answered(0.5)), AxisDynamics(gear_ratio=2.0 * np.pi * 70.0)
    wave = EncoderEccentricity(1e-6, 0.3)
    alone, beside = (wave.predict(motion, each) for each in (axis, Inertia(1.0).on(axis)))
    np.testing.assert_allclose(beside, 2.0 * alone, rtol=1e-6)


def test_loops_that_give_nothing_do_not_bear_a_weight_through_an_uneven_gear_either() -> None:
    motion = moving(1.0, 0.01, answered(0.0))
    motion = replace(motion, rigid_torque=motion.rigid_torque + 200.0)
    cost = TransmissionError(1e-6, 1.0).predict(motion, AxisDynamics(gear_ratio=2.0 * np.pi * 70.0))
    whole = 200.0 * 1e-6 * 2.0 * np.pi * 70.0 / np.sqrt(2.0)
    assert np.std(cost) < 0.01 * whole


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_wave_is_as_much_smaller_and_later_as_the_loops_say(way: float) -> None:
    """Later in time is behind in position where the axis goes up, and ahead where it goes down."""
    share = 0.5 * np.exp(-1j)
    motion = moving(way, 0.01, Sampling(0.01, lambda frequency: np.full(len(frequency), share), 20.0, 1.0))
    slow, fast = 2.0 * np.pi * 5.0, 2.0 * np.pi * 70.0
    angle = fast * motion.position + 0.3
    np.testing.assert_allclose(motion.wave(angle, slow), np.sin(angle), atol=1e-3)
    np.testing.assert_allclose(motion.wave(angle, fast), 0.5 * np.sin(angle - way), atol=1e-3)


@pytest.mark.parametrize(("frequency", "there"), [(30.0, True), (70.0, False), (130.0, False), (180.0, True)])
def test_what_a_filter_took_from_a_torque_before_it_is_thinned_is_not_there(frequency: float, there: bool) -> None:
    """Read 100 times a second of 200 samples: 130 Hz is 70 Hz there, and 180 Hz is 20 Hz."""
    motion = moving(1.0, 0.01, Sampling(0.005, lambda frequency: np.ones(len(frequency), dtype=np.complex128), 80.0, 1.0))
    number = 2.0 * np.pi * frequency
    wave = motion.wave(number * motion.position + 0.3, number)
    assert bool(np.abs(wave).max() > 0.1) == there
