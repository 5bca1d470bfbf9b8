"""Recordings in closed form: a known motion, a known friction law, a torque sensor and an encoder with noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo, Samples

PERIOD = 1e-3
INERTIA = 1.0
SPEEDS = (0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.0)
STRIBECK = FrictionLaw(coulomb=1.9, viscous=1.15, static_rise=0.5, stribeck_velocity=0.05)
PLAIN = FrictionLaw(coulomb=1.9, viscous=1.15)

TURNTABLE = """
<mujoco model="turntable">
  <worldbody>
    <body><joint name="turn" type="hinge" axis="0 0 1" armature="0.2"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.8 0.8 0.8"/></body>
  </worldbody>
</mujoco>
"""


def turntable() -> Model:
    """One revolute axis of 1 kg·m² without gravity."""
    return Model(mujoco.MjModel.from_xml_string(TURNTABLE))


@dataclass(frozen=True)
class Motion:
    """Closed form: position, velocity, acceleration (n,) [rad], and where the axis is commanded to stand."""

    position: Samples
    velocity: Samples
    acceleration: Samples


def strokes(speeds: tuple[float, ...] = SPEEDS, hold: float = 0.8, ramp: float = 0.15, pause: float = 0.1) -> Motion:
    """A stroke at each speed forwards and backwards, raised-cosine ramps [s] and a pause [s] between."""
    parts = [np.zeros(round(0.2 / PERIOD))]
    rise = (1.0 - np.cos(np.pi * (np.arange(round(ramp / PERIOD)) + 0.5) * PERIOD / ramp)) / 2.0
    for speed in speeds:
        for sign in (1.0, -1.0):
            shape = np.concatenate([rise, np.ones(round(hold / PERIOD)), rise[::-1]])
            parts += [sign * speed * shape, np.zeros(round(pause / PERIOD))]
    return from_velocity(np.concatenate([*parts, np.zeros(round(0.2 / PERIOD))]))


def sweep(seconds: float = 6.0) -> Motion:
    """Three sines at 0.5, 1.3 and 2.1 Hz, faded in and out: excites the inertia, reverses swiftly."""
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    tones = ((0.5, 0.8, 0.0), (1.3, 0.5, 1.0), (2.1, 0.3, 2.0))
    fade = np.clip(np.minimum(time, seconds - time) / 0.5, 0.0, 1.0)
    velocity = sum(a * np.cos(2 * np.pi * f * time + p) for f, a, p in tones) * (1.0 - np.cos(np.pi * fade)) / 2.0
    still = np.zeros(round(0.2 / PERIOD))
    return from_velocity(np.concatenate([still, velocity, still]))


def from_velocity(velocity: Samples) -> Motion:
    """A motion with this velocity (n,), sampled finely enough to integrate and differentiate numerically."""
    steps = np.concatenate([[0.0], (velocity[1:] + velocity[:-1]) / 2.0 * PERIOD])
    return Motion(np.cumsum(steps), velocity, np.gradient(velocity, PERIOD))


def record(
    motion: Motion,
    law: FrictionLaw,
    rng: np.random.Generator,
    *,
    name: str = "strokes",
    noise: float = 0.1,
    resolution: float = 2e-6,
    hold_torque: float = 0.8,
) -> Recording:
    """The motion as a drive would record it: white torque noise [N·m], a quantised encoder [rad]; at standstill some
    torque that the stiction happens to hold [N·m]."""
    standing = motion.velocity == 0.0
    torque = INERTIA * motion.acceleration + np.where(standing, hold_torque, law.torque(motion.velocity))
    torque = torque + noise * rng.standard_normal(len(torque))
    position = np.round(motion.position / resolution) * resolution
    info = RecordingInfo(
        machine="turntable",
        sample_period=PERIOD,
        axes={"turn": AxisInfo(joint="turn", position_resolution=resolution)},
    )
    time = np.arange(len(torque), dtype=np.float64) * PERIOD
    return Recording(name, info, time, {"turn": {"torque": torque, "position": position}})


def delayed(recording: Recording, samples: int) -> Recording:
    """`recording` with the torque so many samples earlier than the motion it makes."""
    columns = {
        axis: named | {"torque": np.concatenate([named["torque"][samples:], np.repeat(named["torque"][-1:], samples)])}
        for axis, named in recording.columns.items()
    }
    return replace(recording, columns=columns)
