"""The simulation whose gap is asked for: a MuJoCo model with some effects, and the torque that it needs for a motion."""

from __future__ import annotations

import copy
import logging
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.emulator.assembly import DrivenJoint, assemble
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw
from drivetwin.emulator.effects import Effect, PlacedEffect
from drivetwin.emulator.effects.model_tree import free_name, outermost
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.lately import Lately
from drivetwin.motion.coupled_motion import check_axes_move_alone, friction_of_followers
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.motion.model_file import motors_of, named_model, working_spec
from drivetwin.recording.recording import AxisInfo

Array = NDArray[np.float64]

logger = logging.getLogger(__name__)

ASSEMBLED = 512
"""Axes with some effects that are remembered: a search asks for those of a few sets again and again."""

ASIDE = 1e-4
"""Step of a position [rad or m], over which a torque is differentiated."""


@dataclass(frozen=True)
class Simulation:
    """A model and what drives its joints, by axis. Nothing in it is changed by asking.

    `path` is the MJCF file as it is written; `spec` and `model` are of what of it has a part in the torque.
    """

    path: Path
    drives: Mapping[str, DrivenJoint]
    _assembled: Lately[Hashable, AxisDynamics] = field(init=False, repr=False, compare=False, default_factory=Lately)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the recorded axes."""
        return tuple(self.drives)

    @property
    def joints(self) -> list[str]:
        """Their joints, in the same order."""
        return [drive.joint for drive in self.drives.values()]

    @cached_property
    def _spec(self) -> mujoco.MjSpec:
        return working_spec(self.path, self._add_motors)

    def spec(self) -> mujoco.MjSpec:
        """The model's specification, a new one, in which bodies and actuators have names and every axis has a motor."""
        return self._spec.copy()

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

    def dynamics(self, effects: Sequence[PlacedEffect] = ()) -> dict[str, AxisDynamics]:
        """What each axis is with the effects, and with what follows it. Raises UserError where it cannot have one."""
        return {axis: self.dynamics_of(axis, effects) for axis in self.axes}

    def dynamics_of(self, axis: str, effects: Sequence[PlacedEffect]) -> AxisDynamics:
        """The same of one axis: its own effects alone say what it is, each on top of those before it."""
        own = tuple(one for one in effects if one.axis == axis)
        key = axis, tuple((one.effect, *one.units.items()) for one in own)
        return self._assembled.get(key, lambda: self._assemble(axis, own), ASSEMBLED)

    def _assemble(self, axis: str, effects: tuple[PlacedEffect, ...]) -> AxisDynamics:
        alone = assemble(self.spec(), {axis: self.drives[axis]}, effects)[axis]
        more = self._friction_of_followers[self.axes.index(axis)]
        return replace(alone, friction=_with(alone.friction, *more))

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

    def slopes(self, kinematics: Kinematics, axis: str) -> Array:
        """d torque / d position of one axis, (n, k), by central differences."""
        aside = np.zeros(len(self.axes))
        aside[self.axes.index(axis)] = ASIDE
        ahead, behind = (
            self.torques(replace(kinematics, position=kinematics.position + way * aside)) for way in (1.0, -1.0)
        )
        return np.asarray((ahead - behind) / (2.0 * ASIDE))

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

    def _add_motors(self, spec: mujoco.MjSpec) -> None:
        """On axes that have none: what else it is that moves them, its torque was recorded."""
        there = {actuator.name for actuator in spec.actuators}
        for drive in self.drives.values():
            if drive.actuator not in there:
                motor = spec.add_actuator(name=drive.actuator, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=drive.joint)
                motor.set_to_motor()
                motor.ctrllimited = motor.forcelimited = mujoco.mjtLimited.mjLIMITED_FALSE

    @cached_property
    def _friction_of_followers(self) -> list[tuple[float, float]]:
        """Coulomb and viscous friction that each axis has of the joints and tendons that follow it, at qpos0."""
        return friction_of_followers(self.model, self.rigid.ratios(self.joints), [self.dof(axis) for axis in self.axes])

    def moving_bodies(self) -> list[int]:
        """Bodies with mass that a joint moves."""
        model = self.model
        return [body for body in range(1, model.nbody) if model.body_mass[body] > 0.0 and model.body_weldid[body] != 0]

    def carrier(self, body: int) -> tuple[str, tuple[float, ...]] | None:
        """The axis that carries a body, by its number, and the body's centre of mass (3,) where a payload of the axis is [m].

        None where no recorded axis moves it, and where it moves against the body that a payload is on.
        """
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        joints = {self.model.joint(joint).id: axis for axis, joint in zip(self.axes, self.joints, strict=True)}
        at = body
        while at:
            own = range(self.model.body_jntadr[at], self.model.body_jntadr[at] + self.model.body_jntnum[at])
            axis = next((joints[joint] for joint in reversed(own) if joint in joints), None)
            if axis is not None:
                spec = self._spec
                last = self.model.body(outermost(spec, spec.joint(self.drives[axis].joint).parent).name).id
                if self.model.body_weldid[body] != self.model.body_weldid[last]:
                    return None
                place = data.xmat[last].reshape(3, 3).T @ (data.xipos[body] - data.xpos[last])
                return axis, tuple(float(each) for each in place)
            at = int(self.model.body_parentid[at])
        return None


def simulation(path: Path, axes: Mapping[str, AxisInfo]) -> Simulation:
    """The simulation of an MJCF file for the axes of a recording.

    Raises UserError for a file that MuJoCo refuses, a joint that the model lacks, or one that moves with what was not recorded.
    """
    _, model = named_model(path)
    twin = Simulation(path, {name: _driven(path, model, name, info) for name, info in axes.items()})
    check_axes_move_alone(twin.rigid, {axis: drive.joint for axis, drive in twin.drives.items()})
    return twin


def _with(law: FrictionLaw, coulomb: float, viscous: float) -> FrictionLaw:
    return replace(law, coulomb=law.coulomb + coulomb, viscous=law.viscous + viscous)


def _driven(path: Path, model: mujoco.MjModel, axis: str, info: AxisInfo) -> DrivenJoint:
    joints = {model.joint(index).name: index for index in range(model.njnt)}
    if info.joint not in joints:
        raise UserError(f"{path} has no joint {info.joint!r} for axis {axis!r}; it has {', '.join(joints)}")
    motors = motors_of(model, joints[info.joint])
    if motors:
        actuator = info.actuator if info.actuator in motors else motors[0]
        gear = info.gear_ratio or float(model.actuator(actuator).gear[0]) or 1.0
    else:
        logger.info("%s: nothing drives joint %r of axis %r but the recorded torque", path, info.joint, axis)
        taken = {model.actuator(number).name for number in range(model.nu)}
        actuator = free_name(info.joint, taken)
        gear = info.gear_ratio or 1.0
    home = float(model.qpos0[model.jnt_qposadr[joints[info.joint]]])
    return DrivenJoint(info.joint, actuator, abs(gear), rotor_inertia=0.0, holding_brake=0.0, position=home)
