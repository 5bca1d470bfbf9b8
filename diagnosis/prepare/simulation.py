"""The simulation whose gap is asked for: a MuJoCo model with some effects, and the torque that it needs for a motion."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.errors import UserError
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.recording.recording import AxisInfo
from emulator.assembly import DrivenJoint, assemble
from emulator.dynamics import AxisDynamics
from emulator.effects import Effect, PlacedEffect

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kinematics:
    """A motion of all axes: position, velocity, acceleration, each (n, k) in the order of the simulation's axes; SI."""

    position: Array
    velocity: Array
    acceleration: Array

    def part(self, span: slice) -> Kinematics:
        """Some samples in a row."""
        return Kinematics(self.position[span], self.velocity[span], self.acceleration[span])

    def every(self, stride: int) -> Kinematics:
        """Each stride-th sample."""
        return Kinematics(self.position[::stride], self.velocity[::stride], self.acceleration[::stride])


@dataclass(frozen=True)
class Simulation:
    """A model and what drives its joints, by axis. Nothing in it is changed by asking."""

    path: Path
    drives: Mapping[str, DrivenJoint]

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the recorded axes."""
        return tuple(self.drives)

    @property
    def joints(self) -> list[str]:
        """Their joints, in the same order."""
        return [drive.joint for drive in self.drives.values()]

    def spec(self) -> mujoco.MjSpec:
        """The model's specification, a new one, in which every body and actuator has a name."""
        return named_spec(self.path)

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled model as it stands."""
        return self.spec().compile()

    @cached_property
    def rigid(self) -> Model:
        """Its inverse dynamics without friction."""
        return Model(self.model, self.path)

    def slides(self, axis: str) -> bool:
        """Whether the axis is prismatic."""
        return int(self.model.joint(self.drives[axis].joint).type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE)

    def dof(self, axis: str) -> int:
        """Index of the axis's joint in qvel."""
        return int(self.model.joint(self.drives[axis].joint).dofadr[0])

    def dynamics(self, effects: tuple[PlacedEffect, ...] = ()) -> dict[str, AxisDynamics]:
        """What each axis is with the effects. Raises UserError where an axis cannot have one."""
        return assemble(self.spec(), self.drives, effects)

    def home_inertia(self) -> dict[str, float]:
        """d torque / d acceleration of each axis at qpos0, motor included [kg·m² or kg]."""
        at = np.array([[drive.position for drive in self.drives.values()]])
        rest = np.zeros_like(at)
        still = self.torques(Kinematics(at, rest, rest))[0]
        units = np.eye(len(self.axes))
        return {
            axis: float(self.torques(Kinematics(at, rest, unit[None]))[0, k] - still[k])
            for k, (axis, unit) in enumerate(zip(self.axes, units, strict=True))
        }

    def torques(self, kinematics: Kinematics) -> Array:
        """Torque (n, k) of the rigid model without friction."""
        return self.torques_of(self.rigid, kinematics)

    def torques_of(self, rigid: Model, kinematics: Kinematics) -> Array:
        """The same of a changed model."""
        return rigid.torques(self.joints, kinematics.position, kinematics.velocity, kinematics.acceleration)

    def rigid_with(self, axis: str, effect: Effect) -> Model:
        """The model as an effect on the rigid bodies changes it."""
        spec = self.spec()
        effect.add_to(spec, spec.joint(self.drives[axis].joint), AxisDynamics())
        return Model(spec.compile(), self.path)

    def rigid_with_heavier(self, body: int) -> Model:
        """The model in which one body, by its number, has twice its mass and inertia."""
        heavier = copy.copy(self.model)
        heavier.body_mass[body] *= 2.0
        heavier.body_inertia[body] *= 2.0
        mujoco.mj_setConst(heavier, mujoco.MjData(heavier))
        return Model(heavier, self.path)

    def moving_bodies(self) -> list[int]:
        """Bodies with mass that a joint moves."""
        model = self.model
        return [body for body in range(1, model.nbody) if model.body_mass[body] > 0.0 and model.body_weldid[body] != 0]


def simulation(path: Path, axes: Mapping[str, AxisInfo]) -> Simulation:
    """The simulation of an MJCF file for the axes of a recording.

    Raises UserError for a file that MuJoCo refuses, a joint that the model lacks, or that no motor drives.
    """
    try:
        model = named_spec(path).compile()
    except ValueError as error:
        raise UserError(f"{path} is not a MuJoCo model: {error}") from error
    return Simulation(path, {name: _driven(path, model, name, info) for name, info in axes.items()})


def named_spec(path: Path) -> mujoco.MjSpec:
    """The specification of an MJCF file; bodies and actuators that it leaves without a name, which MJCF allows, get one.

    Files of meshes, height fields and textures are found from wherever the specification is written to. Raises ValueError for a
    file that MuJoCo refuses.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    for kind, elements in (("body", spec.bodies), ("actuator", spec.actuators)):
        taken = {element.name for element in elements}
        free = (name for number in count() if (name := f"{kind}_{number}") not in taken)
        for element in elements:
            element.name = element.name or next(free)
    if spec.meshes or spec.hfields or spec.skins or any(texture.file for texture in spec.textures):
        spec.meshdir, spec.texturedir = (str(path.resolve().parent / folder) for folder in (spec.meshdir, spec.texturedir))
    return spec


def motors_of(model: mujoco.MjModel, joint: int) -> list[str]:
    """Names of the actuators that drive a joint, by its number."""
    on_joint = {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)}
    return [
        model.actuator(number).name
        for number in range(model.nu)
        if int(model.actuator_trntype[number]) in on_joint and int(model.actuator_trnid[number, 0]) == joint
    ]


def _driven(path: Path, model: mujoco.MjModel, axis: str, info: AxisInfo) -> DrivenJoint:
    joints = {model.joint(index).name: index for index in range(model.njnt)}
    if info.joint not in joints:
        raise UserError(f"{path} has no joint {info.joint!r} for axis {axis!r}; it has {', '.join(joints)}")
    motors = motors_of(model, joints[info.joint])
    actuator = info.actuator if info.actuator in motors else next(iter(motors), None)
    if actuator is None:
        raise UserError(f"{path}: no motor drives joint {info.joint!r} of axis {axis!r}; add an actuator on it")
    gear = info.gear_ratio or float(model.actuator(actuator).gear[0]) or 1.0
    home = float(model.qpos0[model.jnt_qposadr[joints[info.joint]]])
    return DrivenJoint(info.joint, actuator, abs(gear), rotor_inertia=0.0, holding_brake=0.0, position=home)
