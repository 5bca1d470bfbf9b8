"""A MuJoCo model whose driven axes have effects of the library: motor torques in, motor angles out, step by step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.assembly import DrivenJoint, assemble, check_time_step, motor_joint
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw
from drivetwin.emulator.dynamics.encoder import Encoders
from drivetwin.emulator.dynamics.friction import Friction, VaryingFriction
from drivetwin.emulator.dynamics.load import Loads
from drivetwin.emulator.dynamics.motor import Motors, Ripples
from drivetwin.emulator.dynamics.place import Place
from drivetwin.emulator.dynamics.records import acting
from drivetwin.emulator.dynamics.resistance import Resistances
from drivetwin.emulator.dynamics.transmission import ElasticTransmissions, UnevenTransmissions
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.model_tree import outermost
from drivetwin.foundation.compiled import compiled


@compiled
def _read_motors(gear, qpos_index, qpos, motor_angle) -> None:  # type: ignore[no-untyped-def]
    """Motor angles (n,) [rad] from joint positions."""
    for axis in range(gear.shape[0]):
        motor_angle[axis] = gear[axis] * qpos[qpos_index[axis]]


class Mechanism:
    """Model and state of a mechanism, its drives' motors and encoders included; knows the truth, and no drive and no bus.

    Each period: `read` fills `motor_position` (n,) [rad] with what the encoders say; `step` takes `motor_torque` (n,) [N·m],
    as the drives report it, and `brakes` (n,) where a holding brake is engaged. `dynamics` is what each axis is,
    `inertia` (n,) its d torque / d acceleration at qpos0, with what follows it [kg·m² or kg].
    """

    def __init__(self, spec: mujoco.MjSpec, drives: Mapping[str, DrivenJoint], effects: tuple[PlacedEffect, ...]) -> None:
        """Build it from a specification, which is changed, with its own time step.

        Raises UserError for an effect on an axis that it has not, in a wrong unit, or that makes no mechanism.
        """
        carriers = [outermost(spec, spec.joint(drive.joint).parent) for drive in drives.values()]
        self.dynamics = assemble(spec, drives, effects)
        self.model = spec.compile()
        self._carriers = np.array([body.id for body in carriers])
        self._masses = self.model.body_mass.copy()
        self._loads = np.zeros(len(carriers))
        self.data = mujoco.MjData(self.model)
        places = [_place(self.model, number, drives[name], axis) for number, (name, axis) in enumerate(self.dynamics.items())]
        self._gear = np.array([place.gear for place in places])
        self._dofs = np.array([place.dof for place in places])
        self._joint_index = np.array([place.qpos for place in places])
        self._motor_index = np.array([place.motor_qpos for place in places])
        self._actuator_index = np.array([place.actuator for place in places])
        self.inertia = self._axis_inertia()
        check_time_step(self.dynamics, [place.motor_inertia for place in places], self.inertia, self.model.opt.timestep)
        self._stand([drive.position for drive in drives.values()])
        self._join(places)

    def joint_positions(self) -> NDArray[np.float64]:
        """True joint positions (n,) [rad or m]."""
        return np.asarray(self.data.qpos[self._joint_index])

    def joint_velocities(self) -> NDArray[np.float64]:
        """True joint velocities (n,) [rad/s or m/s]."""
        return np.asarray(self.data.qvel[self._dofs])

    def set_velocities(self, velocities: NDArray[np.float64]) -> None:
        """Let the axes move at joint velocities (n,) [rad/s or m/s] from now on, with what follows them."""
        moved = np.zeros(self.model.nv)
        moved[self._dofs] = velocities
        self.data.qvel[:] = followers(self.model) @ moved
        mujoco.mj_forward(self.model, self.data)

    def set_friction(self, axis: int, law: FrictionLaw) -> None:
        """Change the friction of an axis from the coming step on: level and stiction; viscous terms stay as they were built."""
        name = list(self.dynamics)[axis]
        self.dynamics[name] = replace(self.dynamics[name], friction=law)
        for friction in self._frictions:
            friction.set_level(axis, law)

    def set_load(self, axis: int, mass: float) -> None:
        """Let a point mass [kg] ride at the centre of mass of the outermost body that the axis moves; 0: none."""
        self._loads[axis] = mass
        body = self._carriers[axis]
        self.model.body_mass[body] = self._masses[body] + self._loads[self._carriers == body].sum()
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))
        for part in self._acting:
            if isinstance(part, UnevenTransmissions):
                part.take_links()
        self.inertia = self._axis_inertia()

    def read(self) -> None:
        """What the encoders say now."""
        _read_motors(self._gear, self._motor_index, self.data.qpos, self._motor_angle)
        for part in self._reading:
            part.read()

    def step(self) -> None:
        """One time step under the motors' torque."""
        self.data.ctrl[self._actuator_index] = self.motor_torque
        for part in self._acting:
            part.act()
        mujoco.mj_step(self.model, self.data)

    def _axis_inertia(self) -> NDArray[np.float64]:
        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, mass)
        motion = followers(self.model)[:, self._dofs]
        return np.asarray(np.einsum("ia,ij,ja->a", motion, mass, motion))

    def _stand(self, positions: list[float]) -> None:
        """Put the axes where they stand at first, with what follows them."""
        self.data.qpos[self._joint_index] = positions
        moved = np.zeros(self.model.nv)
        moved[self._dofs] = (self.data.qpos - self.model.qpos0)[self._joint_index]
        self.data.qpos[:] = self.model.qpos0 + followers(self.model) @ moved
        mujoco.mj_forward(self.model, self.data)

    def _join(self, places: list[Place]) -> None:
        """Set up the parts that have something to do, in the order of the torque's way, and read the encoders at rest."""
        axes, model, data = list(self.dynamics.values()), self.model, self.data
        self.motor_torque = np.zeros(len(axes))
        self.brakes = np.zeros(len(axes), dtype=np.bool_)
        self._motor_angle = np.zeros(len(axes))
        self.motor_position = self._motor_angle
        self._reading: list[UnevenTransmissions | Encoders] = []
        self._acting: list[
            Friction | VaryingFriction | Loads | Resistances | Motors | Ripples | ElasticTransmissions | UnevenTransmissions
        ] = []
        if motors := acting([axis.motor for axis in axes], places):
            self._acting.append(Motors(motors, data))
        ripples = [(ripple, place) for axis, place in zip(axes, places, strict=True) for ripple in axis.ripples]
        if ripples:
            self._acting.append(Ripples(ripples, data))
        self._frictions: list[Friction | VaryingFriction] = [
            Friction([axis.friction for axis in axes], places, self.brakes, model, data)
        ]
        if varying := acting([axis.friction for axis in axes], places):
            self._frictions.append(VaryingFriction(varying, self.brakes, model, data))
        self._acting += self._frictions
        if loads := acting([axis.load for axis in axes], places):
            self._acting.append(Loads(loads, data))
        if resisting := [(one, place) for axis, place in zip(axes, places, strict=True) for one in axis.resisting]:
            self._acting.append(Resistances(resisting, data))
        transmissions = acting([axis.transmission for axis in axes], places)
        if elastic := [row for row in transmissions if row[0].elastic]:
            self._acting.append(ElasticTransmissions(elastic, data))
        if uneven := [row for row in transmissions if not row[0].elastic]:
            rigid = UnevenTransmissions(uneven, self._motor_angle, model, data)
            self._acting.append(rigid)
            self._reading.append(rigid)
        self.read()
        if encoders := acting([axis.encoder for axis in axes], places):
            self.motor_position = self._motor_angle.copy()
            self._reading.append(Encoders(encoders, model.opt.timestep, self._motor_angle, self.motor_position))
            self.read()


def _place(model: mujoco.MjModel, number: int, drive: DrivenJoint, axis: AxisDynamics) -> Place:
    joint = model.joint(drive.joint)
    motor = model.joint(motor_joint(drive)) if axis.transmission.elastic else joint
    rotor = float(model.dof_M0[motor.dofadr[0]] if axis.transmission.elastic else model.dof_armature[joint.dofadr[0]])
    return Place(
        axis=number,
        gear=drive.gear_ratio,
        brake=drive.holding_brake * drive.gear_ratio,
        motor_inertia=rotor,
        qpos=int(joint.qposadr[0]),
        dof=int(joint.dofadr[0]),
        motor_qpos=int(motor.qposadr[0]),
        motor_dof=int(motor.dofadr[0]),
        actuator=int(model.actuator(drive.actuator).id),
    )


def followers(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Matrix (nv, nv): column j is how all joints move with joint j, by linear joint equalities (belts); hinge and slide."""
    motion = np.eye(model.nv)
    for equality in range(model.neq):
        if model.eq_type[equality] == mujoco.mjtEq.mjEQ_JOINT and model.eq_obj2id[equality] >= 0:
            follower = model.jnt_dofadr[model.eq_obj1id[equality]]
            leader = model.jnt_dofadr[model.eq_obj2id[equality]]
            motion[follower, leader] = model.eq_data[equality, 1]
            motion[follower, follower] = 0.0
    return motion
