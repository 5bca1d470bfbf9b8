"""A load on the axis's arm that the model lacks: a tool, a workpiece, a wafer."""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi
from typing import ClassVar

import mujoco
import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import LENGTH, MASS, Exciting, Look, ModelEffect, Need, Parameter
from drivetwin.emulator.effects.ground import Ground, Site
from drivetwin.emulator.effects.model_tree import free_name, outermost

_PLACE = 0.02
"""Of a place [m], the least that matters: it may well be at 0."""
_STEEL = 7850.0
"""Density [kg/m³]: hardly a load is denser."""


@dataclass(frozen=True)
class Payload(ModelEffect):
    """A point mass at (x, y, z) of the outermost body that the axis moves: down the chain to the next driven joint or its end.

    Weight and inertia about every axis follow (parallel axis theorem). Khalil, Gautier, Lemoine, ICRA 2007: its parameters.
    """

    name: ClassVar[str] = "payload"
    family: ClassVar[str] = "rigid body"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SHORT_MOVES})
    of_model: ClassVar[bool] = True
    by_poses: ClassVar[bool] = True
    by_motion: ClassVar[str] = "the same moves in several poses of the machine, and under gravity"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PULL, Look.INERTIA})
    shapes: ClassVar[tuple[float, ...]] = (0.0, 0.1, -0.1, 0.25, -0.25)
    probe: ClassVar[float] = 0.2
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("mass", MASS, low=0.0),
        Parameter("x", LENGTH),
        Parameter("y", LENGTH),
        Parameter("z", LENGTH),
    )

    mass: float
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        return super().sizes(motion, axis) | {name: max(abs(getattr(self, name)), _PLACE) for name in ("x", "y", "z")}

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """Hardly a load is heavier than all that an axis moves; on a hinge, it turns with no less than a ball of steel.

        Weight on a hinge needs mass times distance only: without this, a ton at a tenth of a millimetre would do.
        """
        radius = (0.75 * self.mass / (pi * _STEEL)) ** (1.0 / 3.0)
        own = self.mass if axis.slide else 0.4 * self.mass * radius**2
        times = own / max(float(np.median(motion.inertia)), np.finfo(float).tiny)
        return 0.5 * (max(0.0, log(max(times, 1.0))) / log(2.0)) ** 2

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        body = outermost(spec, joint.parent)
        body.add_body(
            name=free_name(f"{joint.name}_payload", (other.name for other in spec.bodies)),
            pos=(self.x, self.y, self.z),
            ipos=(0.0, 0.0, 0.0),
            mass=self.mass,
            inertia=(0.0, 0.0, 0.0),
            explicitinertial=True,
        )
        return axis

    @classmethod
    def suits(cls, site: Site) -> bool:
        """On the outermost axis; what only turns a disc or rides on a level slide is inertia."""
        return site.number == site.axes - 1 and (site.axes > 1 or site.weight > 0.0)

    @classmethod
    def drawn(cls, ground: Ground) -> Payload:
        x, y, z = (0.0, 0.0, 0.0) if ground.axis.slide else np.array(ground.load_at) * ground.draw.uniform(1.2, 2.2)
        at = float(x), float(y), float(z)
        return cls(ground.size(ground.of_bodies(cls(1.0, *at))), *at)
