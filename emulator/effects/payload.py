"""A load on the axis's arm that the model lacks: a tool, a workpiece, a wafer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics, Motion
from emulator.effects.base import LENGTH, MASS, ModelEffect, Need, Parameter
from emulator.effects.model_tree import free_name, outermost

_PLACE = 0.02
"""Of a place [m], the least that matters: it may well be at 0."""


@dataclass(frozen=True)
class Payload(ModelEffect):
    """A point mass at (x, y, z) of the outermost body that the axis moves: down the chain to the next driven joint or its end.

    Weight and inertia about every axis follow (parallel axis theorem). Khalil, Gautier, Lemoine, ICRA 2007: its parameters.
    """

    name: ClassVar[str] = "payload"
    family: ClassVar[str] = "rigid body"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
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
