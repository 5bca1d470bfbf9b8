"""A turntable with more friction than its model says, and recordings of it: what tests call `drivetwin diagnose` with."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

PERIOD = 1e-3

MODEL = """
<mujoco model="table">
  <option gravity="0 0 0"/>
  <worldbody><body name="table">
    <joint name="rotate" type="hinge" axis="0 0 1" armature="0.2" frictionloss="0.5" damping="0.1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
  </body></worldbody>
  <actuator><motor name="rotate" joint="rotate"/></actuator>
</mujoco>
"""


def record(folder: Path, seconds: float, frequency: float, seed: int) -> None:
    """Two swings at once of a table whose Coulomb friction is 0.8 N·m, not 0.5 as in the model; the rest is the model's."""
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    angle = 2.0 * np.pi * frequency * time
    position = 0.35 * np.sin(angle) + 0.65 * np.sin(0.31 * angle + 1.0)
    velocity = np.gradient(position, PERIOD)
    noise = 0.01 * np.random.default_rng(seed).standard_normal(len(time))
    torque = 0.3 * np.gradient(velocity, PERIOD) + 0.1 * velocity + 0.8 * np.sign(velocity) + noise
    axis = AxisInfo(joint="rotate", actuator="rotate", position_resolution=1e-7, torque_resolution=1e-3)
    info = RecordingInfo(machine="table", sample_period=PERIOD, axes={"rotate": axis})
    write_recording(Recording(folder.name, info, time, {"rotate": {"torque": torque, "position": position}}), folder)


def turntable(folder: Path) -> None:
    """`model.xml`, and `fitted`, `one` and `two` recorded."""
    (folder / "model.xml").write_text(MODEL, encoding="utf-8")
    record(folder / "fitted", 20.0, 0.25, 1)
    record(folder / "one", 8.0, 0.4, 2)
    record(folder / "two", 8.0, 0.33, 3)
