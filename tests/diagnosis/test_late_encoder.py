"""A position that is read late, of a motion that is a formula: what that costs, sampled fast and slowly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.encoder import Encoder
from drivetwin.emulator.dynamics.friction import FrictionLaw
from drivetwin.emulator.dynamics.joint import Joint
from drivetwin.emulator.dynamics.replay import motor_torque
from drivetwin.emulator.effects.delay import Delay
from drivetwin.recording.recording import Recording, RecordingInfo

Array = NDArray[np.float64]

LATE, INERTIA, VISCOUS, COULOMB = 0.0033, 0.2, 0.3, 0.4
WAVES = ((0.5, 2.0 * np.pi * 0.5, 0.0), (0.05, 2.0 * np.pi * 4.0, 1.0), (0.0125, 2.0 * np.pi * 8.0, 2.0))
"""Amplitude [rad], frequency [rad/s] and phase of a motion whose accelerations at 4 and 8 Hz are equal."""
MODEL = f"""<mujoco model="turn"><option gravity="0 0 0"/><worldbody><body><joint name="turn" axis="0 0 1" damping="{VISCOUS}"/>
<inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/></body></worldbody>
<actuator><motor name="turn" joint="turn"/></actuator></mujoco>"""


def recorded(rate: float) -> Recording:
    """The torque as it was, and the position as the encoder told it then."""
    time = np.arange(round(20.0 * rate)) / rate
    position = sum(size * np.sin(speed * (time - LATE) + phase) for size, speed, phase in WAVES)
    velocity = sum(size * speed * np.cos(speed * time + phase) for size, speed, phase in WAVES)
    acceleration = sum(-size * speed**2 * np.sin(speed * time + phase) for size, speed, phase in WAVES)
    axis = {"joint": "turn", "torque_resolution": 1e-6, "position_resolution": 1e-9}
    info = {"schema": "recording/2", "machine": "turn", "sample_period": 1.0 / rate, "axes": {"turn": axis}}
    columns = {"position": np.asarray(position), "torque": np.asarray(INERTIA * acceleration + VISCOUS * velocity)}
    return Recording("waves", RecordingInfo.model_validate(info), time, {"turn": columns})


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_a_position_that_is_read_late_costs_what_the_torque_is_ahead(rate: float, tmp_path: Path) -> None:
    """Straight lines between two samples left 16 % at 50 Hz; a thousand samples a second show no difference."""
    path = tmp_path / "turn.xml"
    path.write_text(MODEL, encoding="utf-8")
    made = prepared(path, [recorded(rate)], [recorded(rate)], Settings())
    (run,) = made.runs
    own = run.axes["turn"]
    gap = (own.torque - own.base)[own.used]
    cost = run.cost("turn", Delay(LATE), made.simulation.dynamics()["turn"])["turn"][own.used]
    assert np.mean((gap - cost) ** 2) < 0.01 * np.mean(gap**2)


def test_what_is_read_late_does_not_ring_at_steps_of_friction(tmp_path: Path) -> None:
    """Coulomb friction is one of two levels; half a sample late it passes from one to the other without going beyond."""
    path = tmp_path / "turn.xml"
    path.write_text(MODEL, encoding="utf-8")
    (run,) = prepared(path, [recorded(1000.0)], [recorded(1000.0)], Settings()).runs
    motion = run.axes["turn"].motion
    late = AxisDynamics(friction=FrictionLaw(coulomb=COULOMB), encoder=Encoder(delay=0.0005))
    friction = _friction(motion, late)
    assert np.max(friction) == pytest.approx(COULOMB)
    assert np.min(friction) == pytest.approx(-COULOMB)


def test_nor_where_friction_grows_with_a_load_that_the_model_lacks(tmp_path: Path) -> None:
    """Half a sample late is the mean of two samples that jump; the hose pulls as hard as the friction is measured by."""
    path = tmp_path / "turn.xml"
    path.write_text(MODEL, encoding="utf-8")
    (run,) = prepared(path, [recorded(1000.0)], [recorded(1000.0)], Settings()).runs
    motion = run.axes["turn"].motion
    law = FrictionLaw(coulomb=0.1, load_coefficient=0.2)
    on_time = AxisDynamics(friction=law, joint=Joint(pull=-10.0))
    friction, steps = _friction(motion, replace(on_time, encoder=Encoder(delay=0.0005))), _friction(motion, on_time)
    between = 0.5 * (steps[:-1] + steps[1:])
    assert np.max(np.abs(friction[:-1] - between)) < 0.002 * np.ptp(steps)


def _friction(motion: Motion, axis: AxisDynamics) -> Array:
    return motor_torque(motion, axis) - motor_torque(motion, replace(axis, friction=FrictionLaw()))
