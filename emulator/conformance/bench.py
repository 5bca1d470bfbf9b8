"""A plant of one axis, moved back and forth by its own control loop, and the recording that a check uses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.assembly import DrivenJoint
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects import AxisEffect, Effect, Ground, PlacedEffect, Site, UnnamedEffect, library
from drivetwin.emulator.mechanism import Mechanism, act, read
from drivetwin.foundation.compiled import compiled
from drivetwin.foundation.mujoco_calls import mj_step
from drivetwin.motion.filtering import derivative, zero_phase
from drivetwin.motion.inverse_dynamics import Model

Array = NDArray[np.float64]
Kind = Literal["hinge", "slide"]

PERIOD = 125e-6
GEAR = 50.0
ROTOR = 2e-5
MOTOR = ROTOR * GEAR**2
"""Inertia of the motor on the joint side: 0.05 kg·m² (kg on a slide)."""
LINK = 0.2
"""Inertia of the link about its hinge, or its mass on a slide [kg·m²; kg]."""
WHOLE = MOTOR + LINK
CUTOFF = 48.0
"""Of torques [Hz]."""
MOTION_CUTOFF = 100.0
"""Of the position [Hz]: what the torques lose, they lose once."""
SAMPLE = 1e-3
WEIGHT = 3.0
"""Moment of the hinge's weight about it [N·m]; the slide's weight [N]."""
STANDSTILL = 0.02
TRAVEL = (-1.0, 1.0)
_SETTLING = 8000
"""Servo periods of standing first; half of them are recorded."""
_SWING = 2.0 * np.pi * 12.0
"""Bandwidth of the velocity loop [rad/s]."""
STROKES = [(0.6, 0.7), (-0.5, 0.6), (0.15, 0.8), (-0.1, 0.9), (0.9, 0.8), (-0.8, 0.6), (0.3, 0.35), (-0.3, 0.4), (0.05, 0.5)]
"""Where to (rad or m), and how long it takes [s]; a rest of 50 ms after each."""

MODELS: dict[Kind, str] = {
    "hinge": """<mujoco model="rig"><compiler angle="radian"/><option gravity="0 0 -10" timestep="0.000125"/><worldbody>
<body><joint name="axis" type="hinge" axis="0 1 0"/><inertial pos="0 0 -0.3" mass="1" diaginertia="0.11 0.11 0.11"/></body>
</worldbody><actuator><motor name="axis" joint="axis"/></actuator></mujoco>""",
    "slide": """<mujoco model="rig"><option gravity="0 0 -15" timestep="0.000125"/><worldbody>
<body><joint name="axis" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="0.2" diaginertia="1 1 1"/></body>
</worldbody><actuator><motor name="axis" joint="axis"/></actuator></mujoco>""",
}


@dataclass(frozen=True)
class Recorded:
    """Motion, as measured, of a plant; the axis as it is without the effects; where it moves (n,)."""

    motion: Motion
    axis: AxisDynamics
    moving: NDArray[np.bool_]

    @property
    def gap(self) -> Array:
        """Filtered torque (n,) beyond the rigid machine and its base friction, while it moves."""
        return self.judged(self.motion.torque - self.motion.rigid_torque - self.axis.friction.resistance(self.motion))

    def judged(self, torque: Array) -> Array:
        """A torque (n,) as a judge of recordings sees it."""
        return zero_phase(torque, SAMPLE, CUTOFF)[self.moving]

    def explained_by(self, found: AxisEffect | UnnamedEffect) -> float:
        """Share of the gap's energy."""
        left = self.gap - self.judged(found.predict(self.motion, self.axis))
        return float(1.0 - np.sum(left**2) / np.sum(self.gap**2))


@cache
def demand() -> Array:
    """Jerk-limited strokes (n,) at the servo period, twice over."""
    parts: list[Array] = [np.zeros(_SETTLING)]
    at = 0.0
    for to, lasts in 2 * STROKES:
        share = np.arange(1, round(lasts / PERIOD) + 1) * PERIOD / lasts
        stroke = np.asarray(at + (to - at) * share**3 * (10.0 - 15.0 * share + 6.0 * share**2), dtype=np.float64)
        parts += [stroke, np.full(400, to)]
        at = to
    return np.concatenate(parts)


def record(kind: Kind, *effects: PlacedEffect) -> Recorded:
    """Move a plant with base friction and these effects by a PID at the encoder; sampled at 1 kHz."""
    positions, torques = _move(_mechanism(kind, *effects), WEIGHT if kind == "slide" else 0.0)
    position = zero_phase(positions, SAMPLE, MOTION_CUTOFF)
    velocity = derivative(position, SAMPLE)
    acceleration = derivative(velocity, SAMPLE)
    inertia = np.full_like(position, WHOLE)
    weight = WEIGHT * (np.sin(position) if kind == "hinge" else 1.0)
    time = np.asarray(_SETTLING // 2 * PERIOD + np.arange(len(position)) * SAMPLE, dtype=np.float64)
    motion = Motion(position, velocity, acceleration, torques, time, WHOLE * acceleration + weight, inertia, MOTOR)
    return Recorded(motion, axis(kind), np.abs(velocity) > STANDSTILL)


def axis(kind: Kind, *effects: PlacedEffect) -> AxisDynamics:
    """An axis with base friction and these effects."""
    return _mechanism(kind, *effects).dynamics["axis"]


def site(kind: Kind) -> Site:
    """Where it stands: alone, under gravity."""
    return Site(number=0, axes=1, slide=kind == "slide", after_slide=False, weight=WEIGHT)


def ground(kind: Kind, seed: int) -> Ground:
    """What effects are drawn for: the bench as it moves without any."""
    plain = _plain(kind)
    return Ground(
        draw=np.random.default_rng(seed),
        motion=plain.motion,
        moving=plain.moving,
        axis=plain.axis,
        travel=TRAVEL,
        max_speed=float(np.abs(plain.motion.velocity).max()),
        max_acceleration=float(np.abs(plain.motion.acceleration).max()),
        bandwidth=_SWING,
        load_at=(0.0, 0.0, 0.0) if kind == "slide" else (0.0, 0.0, -0.3),
        of_bodies=lambda effect: _of_bodies(kind, effect),
    )


@cache
def _plain(kind: Kind) -> Recorded:
    return record(kind)


def _of_bodies(kind: Kind, effect: Effect) -> Array:
    """Torque (n,) that an effect on the rigid bodies costs the motion without it, by inverse dynamics."""
    motion = _plain(kind).motion
    columns = [values[:, None] for values in (motion.position, motion.velocity, motion.acceleration)]
    plain, changed = (mujoco.MjSpec.from_string(MODELS[kind]) for _ in range(2))
    effect.add_to(changed, changed.joint("axis"), AxisDynamics())
    with_it, without = (Model(spec.compile()).torques(["axis"], *columns)[:, 0] for spec in (changed, plain))
    return np.asarray(with_it - without)


def _mechanism(kind: Kind, *effects: PlacedEffect) -> Mechanism:
    known, replaced = library(), {one.effect.name for one in effects}
    base = {"coulomb": 0.5, "viscous": 0.4}
    friction = [PlacedEffect("axis", known[name](**{name: value}), {}) for name, value in base.items() if name not in replaced]
    drives = {"axis": DrivenJoint("axis", "axis", GEAR, ROTOR, 0.0, 0.0)}
    return Mechanism(mujoco.MjSpec.from_string(MODELS[kind]), drives, (*friction, *effects))


def _move(mechanism: Mechanism, holds: float) -> tuple[Array, Array]:
    """Encoder positions and reported torques on the joint side, (n,) each, from a rest at which `holds` is asked."""
    wanted = demand()
    seen, asked = np.empty_like(wanted), np.empty_like(wanted)
    loop = np.array([holds / (WHOLE * _SWING), 0.0, 0.0])
    at_once = 1 if mechanism.resistances.present else len(wanted)  # what is written in Python is asked before each step
    for first in range(0, len(wanted), at_once):
        mechanism.resistances.evaluate()
        _run(
            *(first, first + at_once, wanted, seen, asked, loop, mechanism.motor_position, mechanism.motor_torque),
            *(mechanism.reading, mechanism.acting, mechanism.brakes, mechanism.data.time),
            *(mechanism.model._address, mechanism.data._address),
        )
    every = round(SAMPLE / PERIOD)
    return seen[_SETTLING // 2 :: every], asked[_SETTLING // 2 :: every]


@compiled
def _run(  # type: ignore[no-untyped-def]  # record arrays have no static type
    first, last, wanted, seen, asked, loop, motor_position, motor_torque, reading, acting, brakes, time, model, data
) -> None:
    """Periods `first` to `last`: encoder, PID, one step each. `loop` is its integral, the last position, the filtered speed."""
    parts, state, constants = acting
    for k in range(first, last):
        read(*reading)
        position = motor_position[0] / GEAR
        loop[2] += 0.3 * ((position - loop[1]) / PERIOD - loop[2])
        wish = (wanted[k] - wanted[k - 1]) / PERIOD if k else 0.0
        loop[1] = position
        error = wanted[k] - position
        loop[0] += _SWING / 3.0 * (wish - loop[2] + _SWING / 3.0 * error) * PERIOD
        torque = WHOLE * _SWING * (wish - loop[2] + _SWING / 3.0 * error + loop[0])
        seen[k], asked[k] = position, torque
        motor_torque[0] = torque / GEAR
        act(parts, state, constants, motor_torque, brakes, time)
        mj_step(model, data)
        time += PERIOD
