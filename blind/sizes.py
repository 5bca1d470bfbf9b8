"""How large each effect is drawn: as it says of itself, so that it matters on its machine and motion."""

from __future__ import annotations

from dataclasses import fields

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import FOREIGN, Cause
from drivetwin.blind.foreign import FOREIGN_EFFECTS, Scale
from drivetwin.blind.levels import Levels, extra_torque
from drivetwin.blind.machines import DrawnMachine
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects import AxisEffect, DriveEffect, Effect, Ground, ModelEffect, Site, library

Draw = np.random.Generator

FOREIGN_SHARE = (0.12, 0.28)
"""Torque of an effect outside the library as a share of the axis's, both rms; one of the library may explain a part of it."""

WEIGHTLESS = 1e-9
"""Below this [N·m or N] gravity asks nothing but rounding of an axis."""

Drawable = AxisEffect | DriveEffect | ModelEffect
"""Effects that a diagnosis can answer with."""


def drawable() -> dict[str, type[Drawable]]:
    """Every effect that is drawn, by its name."""
    return {name: kind for name, kind in library().items() if issubclass(kind, Drawable)}


def suits(effect: str, machine: DrawnMachine, axis: str) -> bool:
    """Whether an effect makes sense on an axis and is not another one there; foreign ones do on all."""
    names = list(machine.axes)
    number, own = names.index(axis), machine.axes[axis]
    site = Site(
        number=number,
        axes=len(names),
        slide=own.slide,
        after_slide=number > 0 and machine.axes[names[number - 1]].slide,
        weight=own.weight if own.weight > WEIGHTLESS else 0.0,
    )
    return effect.startswith(FOREIGN) or library()[effect].suits(site)


NOT_SIMULATED = frozenset({"motor_friction_share"})
"""Parameters that the plants of these cases do not have: all their friction is on the load."""


def draw_cause(draw: Draw, effect: str, axis: str, machine: DrawnMachine, levels: dict[str, Levels]) -> Cause:
    """An effect on an axis, of a size that matters on this motion."""
    made = drawable()[effect].drawn(_ground(draw, axis, machine, levels))
    values = {one.name: (float(getattr(made, one.name)), one.default) for one in fields(made) if one.name not in NOT_SIMULATED}
    return Cause(effect, axis, {name: value for name, (value, unless) in values.items() if not value == unless == 0.0})


def _ground(draw: Draw, axis: str, machine: DrawnMachine, levels: dict[str, Levels]) -> Ground:
    own, level = machine.axes[axis], levels[axis]
    law = FrictionLaw(coulomb=own.coulomb, viscous=own.viscous)
    sliding = np.where(level.moving, own.coulomb * np.sign(level.velocity), 0.0) + own.viscous * level.velocity
    motion = Motion(
        position=level.position,
        velocity=level.velocity,
        acceleration=level.acceleration,
        torque=level.torque,
        time=level.time,
        rigid_torque=level.torque - sliding,
        inertia=np.full_like(level.time, own.inertia),
        rotor_inertia=own.rotor_inertia * own.gear_ratio**2,
    )
    link = mujoco.MjSpec.from_string(machine.model).joint(axis).parent.geoms[0].pos

    def of_bodies(effect: Effect) -> NDArray[np.float64]:
        spec = mujoco.MjSpec.from_string(machine.model)
        effect.add_to(spec, spec.joint(axis), AxisDynamics())
        return extra_torque(machine, spec.compile(), levels)[axis]

    return Ground(
        draw=draw,
        motion=motion,
        moving=level.moving,
        axis=AxisDynamics(own.gear_ratio, own.slide, friction=law),
        travel=own.travel,
        max_speed=own.max_speed,
        max_acceleration=own.max_acceleration,
        bandwidth=own.bandwidth,
        load_at=(float(link[0]), float(link[1]), float(link[2])),
        of_bodies=of_bodies,
    )


def draw_foreign(draw: Draw, effect: str, axis: str, machine: DrawnMachine, levels: dict[str, Levels]) -> Cause:
    """An effect outside the library on an axis, of a size that matters on this motion."""
    level, share = levels[axis], float(draw.uniform(*FOREIGN_SHARE))
    scale = Scale(
        torque=share * level.torque_rms,
        axis_torque=level.torque_rms,
        friction=machine.axes[axis].coulomb,
        room=machine.axes[axis].room,
        acceleration=level.rms(level.acceleration),
    )
    values = FOREIGN_EFFECTS[effect.removeprefix(FOREIGN)].drawn(draw, scale)
    return Cause(effect, axis, {name: float(value) for name, value in values.items()})
