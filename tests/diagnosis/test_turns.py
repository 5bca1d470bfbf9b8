"""Recordings with a zero of their own, of a screw whose torque is a formula: placed within a turn of the motor by its waves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.prepare.turns import HOW
from drivetwin.diagnosis.report.result import Cause
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording, RecordingInfo

PERIOD, INERTIA, COULOMB, VISCOUS, GEAR, NOISE = 0.005, 0.02, 1.0, 0.02, 2.0, 0.02
ONCE, TWICE, PHASE = 0.3, 0.15, 1.1
"""Amplitudes [N·m] of one and two waves a motor turn, and the phase of the second [rad]."""
SPEEDS = (1.0, -1.0, 2.0, -2.0, 4.0, -4.0, 8.0, -8.0)
ZEROS = (0.0, 1.3, -0.9, 2.9, -2.2, 0.4, 1.9, -1.4)
"""Where the recording at each speed [rad/s] truly begins, on the joint [rad]; a motor turn is pi."""
MODEL = """<mujoco model="screw"><option gravity="0 0 {gravity}"/><worldbody><body>
<joint name="screw" axis="0 1 0" frictionloss="1" damping="0.02"/>
<inertial pos="0 0 -{arm}" mass="1" diaginertia="0.02 0.02 0.02"/></body></worldbody>
<actuator><motor name="screw" joint="screw"/></actuator></mujoco>"""


Array = NDArray[np.float64]
Wave = Callable[[Array, Array], Array]
"""Torque of the motor's angle and velocity."""


def cogging(motor: Array, _velocity: Array) -> Array:
    return np.asarray(ONCE * np.sin(motor) + TWICE * np.sin(2.0 * motor + PHASE))


def rubbing(motor: Array, velocity: Array) -> Array:
    return np.sign(velocity) * cogging(motor, velocity)


def once(motor: Array, _velocity: Array) -> Array:
    return np.asarray(ONCE * np.sin(motor))


def nothing(motor: Array, _velocity: Array) -> Array:
    return np.zeros_like(motor)


def turning(
    speed: float, zero: float, wave: Wave = cogging, noise: Array | None = None, swings: bool = False, back: float = 0.0
) -> Recording:
    """At one speed, which `swings` reverse, and which goes `back` at last [s]; what is recorded begins at 0, the motor at
    `zero`."""
    rng = np.random.default_rng([round(100.0 * speed) % 2**32, round(100.0 * zero) % 2**32])
    time = np.arange(round(20.0 / PERIOD), dtype=np.float64) * PERIOD
    travelled = speed * (np.abs((time + 4.0) % 8.0 - 4.0) if swings else np.minimum(time, 2.0 * (20.0 - back) - time))
    velocity = np.gradient(travelled, PERIOD)
    torque = COULOMB * np.sign(velocity) + VISCOUS * velocity + wave(GEAR * (zero + travelled), velocity)
    torque = torque + (NOISE * rng.standard_normal(len(time)) if noise is None else noise)
    return recorded(f"{speed:+.0f}", time, travelled, torque)


def recorded(name: str, time: Array, travelled: Array, torque: Array) -> Recording:
    told = {"joint": "screw", "gear_ratio": GEAR, "position_relative": True, "position_resolution": 1e-6}
    info = RecordingInfo.model_validate(
        {"schema": "recording/2", "machine": "screw", "sample_period": PERIOD, "axes": {"screw": told}}
    )
    return Recording(name, info, time, {"screw": {"position": np.asarray(travelled), "torque": np.asarray(torque)}})


def made_ready(folder: Path, fitted: Sequence[Recording], held: Sequence[Recording], arm: float = 0.0) -> Prepared:
    path = folder / "model.xml"
    path.write_text(MODEL.format(gravity=-9.81 if arm else 0.0, arm=arm), encoding="utf-8")
    return prepared(path, fitted, held, Settings())


def every_speed(wave: Wave = cogging, back: float = 0.0) -> list[Recording]:
    return [turning(speed, zero, wave, back=back) for speed, zero in zip(SPEEDS, ZEROS, strict=True)]


def strokes(turns: float, zero: float, peak: float) -> Recording:
    """One stroke of some motor turns after the other, one way, with a Stribeck curve that no model has."""
    rng = np.random.default_rng(round(100.0 * turns))
    way, time = turns * 2.0 * np.pi / GEAR, np.arange(round(20.0 / PERIOD), dtype=np.float64) * PERIOD
    lasts = 1.875 * way / peak
    s = (time % lasts) / lasts
    travelled = way * (np.floor(time / lasts) + s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
    velocity = way / lasts * 30.0 * s**2 * (1.0 - s) ** 2
    acceleration = way / lasts**2 * 60.0 * s * (1.0 - 3.0 * s + 2.0 * s**2)
    friction = np.sign(velocity) * (COULOMB + 0.5 * np.exp(-((velocity / 0.5) ** 2)))
    torque = INERTIA * acceleration + VISCOUS * velocity + friction + NOISE * rng.standard_normal(len(time))
    return recorded(f"{turns:g} at {zero:g}", time, travelled, torque)


def asked(ready: Prepared) -> set[str]:
    return {kind.name for kind in ready.testable["screw"].kinds}


def test_every_recording_is_placed_where_it_truly_began(tmp_path: Path) -> None:
    """But for one angle that all have in common: nothing tells where in a turn the motor's own zero is."""
    ready = made_ready(tmp_path, every_speed(), [turning(3.0, 0.7)])
    runs = [*ready.runs, *ready.checks]
    placed = [run.axes["screw"].motion.position[0] for run in runs]
    began = np.array([*ZEROS, 0.7])
    off = (np.array(placed) - began) * GEAR
    off = np.angle(np.exp(1j * (off - off[0])))
    assert np.abs(off).max() < np.deg2rad(3.0)
    assert {"torque_ripple", "position_friction", "transmission_error"} <= asked(ready)
    assert not {"spring", "gravity"} & asked(ready), "a turn is told, not which one"
    assert ready.notes[-1] == f"screw: the position is relative; {HOW}."


@pytest.mark.parametrize("seed", range(5))
def test_noise_that_wanders_places_nothing(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    wandering = [np.cumsum(rng.standard_normal(4000)) for _ in SPEEDS]
    each = zip(SPEEDS, ZEROS, wandering, strict=True)
    fitted = [turning(speed, zero, nothing, 0.2 * one / np.std(one)) for speed, zero, one in each]
    ready = made_ready(tmp_path, fitted, [turning(3.0, 0.7, nothing)])
    assert "torque_ripple" not in asked(ready)
    assert all(run.axes["screw"].motion.position[0] == pytest.approx(0.0, abs=0.01) for run in ready.runs)


def test_a_position_that_the_model_feels_is_not_placed_by_a_wave(tmp_path: Path) -> None:
    ready = made_ready(tmp_path, every_speed(), [turning(3.0, 0.7)], arm=0.1)
    assert not any("wave of its torque" in note for note in ready.notes)


@pytest.mark.parametrize("turns", [3.0, 5.0])
def test_what_comes_back_with_every_stroke_places_nothing(turns: float, tmp_path: Path) -> None:
    """A friction of the speed, and an inertia, repeat every turn where every stroke is a whole number of them."""
    fitted = [strokes(turns, zero, peak) for zero, peak in ((0.0, 6.0), (1.3, 4.0), (-0.9, 8.0))]
    ready = made_ready(tmp_path, fitted, [strokes(turns, 0.4, 5.0)])
    assert "torque_ripple" not in asked(ready)


def answer(folder: Path, wave: Wave, back: float = 0.0, left: float = 0.05) -> Cause:
    """What is named first; `left`: share of the gap that has no name, at most."""
    held = [turning(3.0, 0.7, wave, back=back), turning(-3.0, -0.2, wave, back=back)]
    made_ready(folder, every_speed(wave), held)
    found = diagnose(folder / "model.xml", every_speed(wave, back), held, Settings(), lambda _what, _share: None)
    assert found.axes["screw"].unknown.share < left
    return found.causes[0]


@pytest.mark.parametrize("back", [0.0, 0.3])
def test_one_period_a_turn_is_of_the_torque_or_of_the_friction_while_every_recording_goes_one_way(
    back: float, tmp_path: Path
) -> None:
    """Half a period apart they are the same. A moment of the other direction tells no more."""
    first = answer(tmp_path, once, back, left=0.05 if back == 0.0 else 0.06)  # a reversal has a gap of its own
    names = {first.effect, *first.indistinguishable_from}
    assert {"torque_ripple", "position_friction"} <= names
    assert first.parameters["amplitude"].value == pytest.approx(ONCE, rel=0.05)


def test_two_periods_a_turn_besides_distinguish_a_wave_of_the_torque(tmp_path: Path) -> None:
    """Half a period of the one is a whole one of the other."""
    first = answer(tmp_path, cogging)
    assert first.effect == "torque_ripple"
    assert "position_friction" not in first.indistinguishable_from
    assert first.parameters["amplitude"].value == pytest.approx(ONCE, rel=0.05)


def test_two_periods_a_turn_distinguish_a_wave_of_the_friction(tmp_path: Path) -> None:
    """An axis has one wave of friction: the second one stays without a name."""
    first = answer(tmp_path, rubbing, left=1.1 * TWICE**2 / (ONCE**2 + TWICE**2))
    assert first.effect == "position_friction"
    assert "torque_ripple" not in first.indistinguishable_from


def test_recordings_that_reverse_distinguish_a_wave_of_the_torque(tmp_path: Path) -> None:
    fitted = [turning(abs(speed), zero, swings=True) for speed, zero in zip(SPEEDS[::2], ZEROS, strict=False)]
    ready = made_ready(tmp_path, fitted, [turning(3.0, 0.7, swings=True)])
    assert "torque_ripple" in asked(ready)
    assert ready.turned_one_way == frozenset()
