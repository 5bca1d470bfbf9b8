"""A plant of one axis moved back and forth by a loop of the test's own, and what a judge makes of its recording."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from effect_bench import GEAR, MOTOR, PERIOD, WHOLE, Array, Rig, effect

from drivetwin.motion.filtering import derivative, zero_phase
from emulator.dynamics import AxisDynamics, Motion
from emulator.effects import AxisEffect, PlacedEffect

CUTOFF = 48.0
"""Of torques [Hz]."""
MOTION_CUTOFF = 100.0
"""Of the position [Hz]: what the torques lose, they lose once."""
SAMPLE = 1e-3
WEIGHT = 3.0
"""Moment of the hinge's weight about it [N·m]; the slide's weight [N]."""
STANDSTILL = 0.02
_SETTLING = 8000
"""Servo periods of standing first; half of them are recorded."""
BASE = (effect("coulomb", coulomb=0.5), effect("viscous", viscous=0.4))
STROKES = [(0.6, 0.7), (-0.5, 0.6), (0.15, 0.8), (-0.1, 0.9), (0.9, 0.8), (-0.8, 0.6), (0.3, 0.35), (-0.3, 0.4), (0.05, 0.5)]
"""Where to (rad or m), and how long it takes [s]; a rest of 50 ms after each."""

HINGE = """<mujoco model="rig"><compiler angle="radian"/><option gravity="0 0 -10" timestep="0.000125"/><worldbody>
<body><joint name="axis" type="hinge" axis="0 1 0"/><inertial pos="0 0 -0.3" mass="1" diaginertia="0.11 0.11 0.11"/></body>
</worldbody><actuator><motor name="axis" joint="axis"/></actuator></mujoco>"""

SLIDE = """<mujoco model="rig"><option gravity="0 0 -15" timestep="0.000125"/><worldbody>
<body><joint name="axis" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="0.2" diaginertia="1 1 1"/></body>
</worldbody><actuator><motor name="axis" joint="axis"/></actuator></mujoco>"""


@dataclass(frozen=True)
class Recorded:
    """Motion, as measured, of a plant; the axis as it is without the effects; where it moves (n,)."""

    motion: Motion
    axis: AxisDynamics
    moving: Array

    @property
    def gap(self) -> Array:
        """Filtered torque (n,) beyond the rigid machine and its base friction, while it moves."""
        return self.judged(self.motion.torque - self.motion.rigid_torque - self.axis.friction.resistance(self.motion))

    def judged(self, torque: Array) -> Array:
        """A torque (n,) as a judge of recordings sees it."""
        return zero_phase(torque, SAMPLE, CUTOFF)[self.moving]

    def explained_by(self, found: AxisEffect) -> float:
        """Share of the gap's energy."""
        left = self.gap - self.judged(found.predict(self.motion, self.axis))
        return float(1.0 - np.sum(left**2) / np.sum(self.gap**2))


@cache
def demand() -> Array:
    """Jerk-limited strokes (n,) at the servo period, twice over."""
    parts, at = [np.zeros(_SETTLING)], 0.0
    for to, lasts in 2 * STROKES:
        share = np.arange(1, round(lasts / PERIOD) + 1) * PERIOD / lasts
        parts += [at + (to - at) * share**3 * (10.0 - 15.0 * share + 6.0 * share**2), np.full(400, to)]
        at = to
    return np.concatenate(parts)


def record(kind: str, *effects: PlacedEffect) -> Recorded:
    """Move a plant with base friction and these effects by a PID at the encoder; sampled at 1 kHz."""
    positions, torques = _move(_rig(kind, *effects), WEIGHT if kind == "slide" else 0.0)
    position = zero_phase(positions, SAMPLE, MOTION_CUTOFF)
    velocity = derivative(position, SAMPLE)
    acceleration = derivative(velocity, SAMPLE)
    inertia = np.full_like(position, WHOLE)
    weight = WEIGHT * (np.sin(position) if kind == "hinge" else 1.0)
    time = _SETTLING // 2 * PERIOD + np.arange(len(position)) * SAMPLE
    motion = Motion(position, velocity, acceleration, torques, time, WHOLE * acceleration + weight, inertia, MOTOR)
    return Recorded(motion, axis(kind), np.abs(velocity) > STANDSTILL)


def axis(kind: str, *effects: PlacedEffect) -> AxisDynamics:
    """An axis with base friction and these effects."""
    return _rig(kind, *effects).mechanism.dynamics["axis"]


def _rig(kind: str, *effects: PlacedEffect) -> Rig:
    replaced = {one.effect.name for one in effects}
    return Rig({"hinge": HINGE, "slide": SLIDE}[kind], *(one for one in BASE if one.effect.name not in replaced), *effects)


def _move(rig: Rig, holds: float) -> tuple[Array, Array]:
    """Encoder positions and reported torques on the joint side, (n,) each, from a rest at which `holds` is asked."""
    mechanism, wanted = rig.mechanism, demand()
    seen, asked = np.empty_like(wanted), np.empty_like(wanted)
    swing = 2.0 * np.pi * 12.0
    integral, last, speed = holds / (WHOLE * swing), 0.0, 0.0
    for k, target in enumerate(wanted):
        mechanism.read()
        position = mechanism.motor_position[0] / GEAR
        speed += 0.3 * ((position - last) / PERIOD - speed)
        wish = (target - wanted[k - 1]) / PERIOD if k else 0.0
        last = position
        error = target - position
        integral += swing / 3.0 * (wish - speed + swing / 3.0 * error) * PERIOD
        torque = WHOLE * swing * (wish - speed + swing / 3.0 * error + integral)
        seen[k], asked[k] = position, torque
        mechanism.motor_torque[0] = torque / GEAR
        mechanism.step()
    every = round(SAMPLE / PERIOD)
    return seen[_SETTLING // 2 :: every], asked[_SETTLING // 2 :: every]

