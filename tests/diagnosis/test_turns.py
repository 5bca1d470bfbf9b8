"""Recordings with a zero of their own, of a screw whose torque is a formula: placed within a turn of the motor by its waves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
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


def waves(motor: np.ndarray) -> np.ndarray:
    return np.asarray(ONCE * np.sin(motor) + TWICE * np.sin(2.0 * motor + PHASE))


def turning(speed: float, zero: float, size: float = 1.0, noise: np.ndarray | None = None, swings: bool = False) -> Recording:
    """At one speed, which `swings` reverse; what is recorded begins at 0, the motor at `zero`. `size`: of the waves."""
    rng = np.random.default_rng([round(100.0 * speed) % 2**32, round(100.0 * zero) % 2**32])
    time = np.arange(round(20.0 / PERIOD), dtype=np.float64) * PERIOD
    travelled = speed * (np.abs((time + 4.0) % 8.0 - 4.0) if swings else time)
    velocity = np.gradient(travelled, PERIOD)
    torque = COULOMB * np.sign(velocity) + VISCOUS * velocity + size * waves(GEAR * (zero + travelled))
    torque = torque + (NOISE * rng.standard_normal(len(time)) if noise is None else noise)
    told = {"joint": "screw", "gear_ratio": GEAR, "position_relative": True, "position_resolution": 1e-6}
    info = RecordingInfo.model_validate(
        {"schema": "recording/2", "machine": "screw", "sample_period": PERIOD, "axes": {"screw": told}}
    )
    return Recording(f"{speed:+.0f}", info, time, {"screw": {"position": np.asarray(travelled), "torque": np.asarray(torque)}})


def made_ready(folder: Path, fitted: Sequence[Recording], held: Sequence[Recording], arm: float = 0.0) -> Prepared:
    path = folder / "model.xml"
    path.write_text(MODEL.format(gravity=-9.81 if arm else 0.0, arm=arm), encoding="utf-8")
    return prepared(path, fitted, held, Settings())


def every_speed() -> list[Recording]:
    return [turning(speed, zero) for speed, zero in zip(SPEEDS, ZEROS, strict=True)]


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
    how = "each recording is placed by the wave of its torque over a turn of the motor."
    assert ready.notes[-1] == f"screw: the position is relative; {how}"


@pytest.mark.parametrize("seed", range(5))
def test_noise_that_wanders_places_nothing(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    wandering = [np.cumsum(rng.standard_normal(4000)) for _ in SPEEDS]
    each = zip(SPEEDS, ZEROS, wandering, strict=True)
    fitted = [turning(speed, zero, 0.0, 0.2 * one / np.std(one)) for speed, zero, one in each]
    ready = made_ready(tmp_path, fitted, [turning(3.0, 0.7, 0.0)])
    assert "torque_ripple" not in asked(ready)
    assert all(run.axes["screw"].motion.position[0] == pytest.approx(0.0, abs=0.01) for run in ready.runs)


def test_a_position_that_the_model_feels_is_not_placed_by_a_wave(tmp_path: Path) -> None:
    ready = made_ready(tmp_path, every_speed(), [turning(3.0, 0.7)], arm=0.1)
    assert not any("wave of its torque" in note for note in ready.notes)


def test_a_wave_is_named_and_predicted_where_every_recording_has_its_own_zero(tmp_path: Path) -> None:
    """While every recording goes one way, friction that varies over a turn is the same torque, half a turn off: it is said."""
    made_ready(tmp_path, every_speed(), [turning(3.0, 0.7)])
    found = diagnose(
        tmp_path / "model.xml", every_speed(), [turning(3.0, 0.7), turning(-3.0, -0.2)], Settings(), lambda _what, _share: None
    )
    first = found.causes[0]
    assert first.effect == "torque_ripple"
    assert first.parameters["amplitude"].value == pytest.approx(ONCE, rel=0.05)
    assert "position_friction" in first.indistinguishable_from
    assert found.axes["screw"].unknown.share < 0.05


def test_recordings_that_reverse_distinguish_a_wave_of_the_torque(tmp_path: Path) -> None:
    fitted = [turning(abs(speed), zero, swings=True) for speed, zero in zip(SPEEDS[::2], ZEROS, strict=False)]
    ready = made_ready(tmp_path, fitted, [turning(3.0, 0.7, swings=True)])
    assert "torque_ripple" in asked(ready)
    assert ready.turned_one_way == frozenset()
