"""A MuJoCo model whose driven axes have effects of the library: motor torques in, motor angles out, step by step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.assembly import DrivenJoint, assemble, check_time_step, motor_joint
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw
from drivetwin.emulator.dynamics.encoder import Encoders, read_encoders
from drivetwin.emulator.dynamics.friction import Friction, apply_friction, vary_friction
from drivetwin.emulator.dynamics.load import Load, apply_loads
from drivetwin.emulator.dynamics.motor import Motor, Ripple, apply_motors, apply_ripples
from drivetwin.emulator.dynamics.place import Place
from drivetwin.emulator.dynamics.records import acting, records
from drivetwin.emulator.dynamics.resistance import Resistances, apply_resistances
from drivetwin.emulator.dynamics.transmission import (
    ElasticTransmissions,
    UnevenTransmissions,
    apply_elastic,
    apply_uneven,
    read_uneven,
)
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.model_tree import outermost
from drivetwin.foundation.compiled import in_place
from drivetwin.foundation.mujoco_calls import stop_clocks
from drivetwin.motion.coupled_motion import friction_of_followers


@in_place
def read(gear, motors, qpos, uneven, encoders, delays, history, newest, angle, position) -> None:  # type: ignore[no-untyped-def]
    """Motor angles (n,) [rad] from joint positions, and what the encoders tell of them."""
    for axis in range(gear.shape[0]):
        angle[axis] = gear[axis] * qpos[motors[axis]]
    read_uneven(uneven, qpos, angle)
    read_encoders(encoders, delays, history, newest, angle, position)


@in_place
def act(parts, state, constants, motor_torque, brakes, time) -> None:  # type: ignore[no-untyped-def]
    """Set what acts in the coming step, in the order of the torque's way, for motor torques (n,) as the drives report them.

    `parts`, `state` (of MuJoCo's data) and `constants` (of its model) are those of `Mechanism.acting`.
    """
    actuators, motors, ripples, laws, varying, anchors, loads, resisted, resistance, elastic, uneven, links = parts
    qpos, qvel, ctrl, applied = state
    frictionloss, damping, polynomial, armature, simple = constants
    for axis in range(actuators.shape[0]):
        ctrl[actuators[axis]] = motor_torque[axis]
    apply_motors(motors, ctrl)
    apply_ripples(ripples, qpos, ctrl)
    apply_friction(laws, brakes, qvel, frictionloss, applied)
    vary_friction(varying, anchors, brakes, time, qpos, qvel, ctrl, frictionloss, applied, damping, polynomial)
    apply_loads(loads, qpos, applied)
    apply_resistances(resisted, resistance, applied)
    apply_elastic(elastic, qpos, qvel, applied)
    apply_uneven(uneven, links, qpos, qvel, ctrl, armature, simple, applied)


class Mechanism:
    """Model and state of a mechanism, its drives' motors and encoders included; knows the truth, and no drive and no bus.

    Each period: `read` fills `motor_position` (n,) [rad] with what the encoders say; `step` takes `motor_torque` (n,) [N·m],
    as the drives report it, and `brakes` (n,) where a holding brake is engaged. `dynamics` is what each axis is,
    `inertia` (n,) its d torque / d acceleration at qpos0, with what follows it [kg·m² or kg]. `reading` and `acting` are the
    arguments of the compiled `read` and `act`; `resistances` have to be evaluated before the latter.
    """

    def __init__(self, spec: mujoco.MjSpec, drives: Mapping[str, DrivenJoint], effects: tuple[PlacedEffect, ...]) -> None:
        """Build it from a specification, which is changed, with its own time step.

        Raises UserError for an effect on an axis that it has not, in a wrong unit, or that makes no mechanism.
        """
        stop_clocks()
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
        self._motor_dofs = np.array([place.motor_dof for place in places])
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
        self._friction.set_level(axis, law)

    def set_load(self, axis: int, mass: float) -> None:
        """Let a point mass [kg] ride at the centre of mass of the outermost body that the axis moves; 0: none."""
        self._loads[axis] = mass
        body = self._carriers[axis]
        self.model.body_mass[body] = self._masses[body] + self._loads[self._carriers == body].sum()
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))
        self._uneven.take_links()
        self.inertia = self._axis_inertia()

    def read(self) -> None:
        """What the encoders say now."""
        read(*self.reading)

    def step(self) -> None:
        """One time step under the motors' torque."""
        self.resistances.evaluate()
        act(*self.acting, self.motor_torque, self.brakes, self.data.time)
        mujoco.mj_step(self.model, self.data)

    def friction_laws(self) -> dict[str, FrictionLaw]:
        """The friction that each axis feels: its joint's and its motor's, and that of the joints that follow it."""
        ratios = followers(self.model)[:, self._dofs]
        theirs = friction_of_followers(self.model, ratios, [*self._dofs.tolist(), *self._motor_dofs.tolist()])
        return {
            name: replace(
                axis.friction,
                coulomb=axis.friction.coulomb + level,
                viscous=axis.friction.viscous + slope,
                static_torque=axis.friction.static_torque + level,
            )
            for (name, axis), (level, slope) in zip(self.dynamics.items(), theirs, strict=True)
        }

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
        """Set up the parts of every axis, and read the encoders at rest."""
        axes, model, data = list(self.dynamics.values()), self.model, self.data
        self.motor_torque = np.zeros(len(axes))
        self.brakes = np.zeros(len(axes), dtype=np.bool_)
        transmissions = acting([axis.transmission for axis in axes], places)
        elastic = ElasticTransmissions([row for row in transmissions if row[0].elastic], data)
        shares = [axis.transmission.motor_friction_share for axis in axes]
        self._friction = Friction([axis.friction for axis in axes], shares, places, data)
        self._uneven = uneven = UnevenTransmissions([row for row in transmissions if not row[0].elastic], model)
        placed = list(zip(axes, places, strict=True))
        self.resistances = Resistances([(one, place) for axis, place in placed for one in axis.resisting], data)
        motor_angle = self._gear * data.qpos[self._motor_index]
        read_uneven(uneven.rows, data.qpos, motor_angle)
        encoders = Encoders(acting([axis.encoder for axis in axes], places), model.opt.timestep, motor_angle)
        self.motor_position = motor_angle.copy()
        self.reading = (
            *(self._gear, self._motor_index, data.qpos, uneven.rows, *encoders.arrays),
            *(motor_angle, self.motor_position),
        )
        parts = (
            self._actuator_index,
            records((Motor, Place), acting([axis.motor for axis in axes], places)),
            records((Ripple, Place), [(one, place) for axis, place in placed for one in axis.ripples]),
            *(self._friction.laws, self._friction.varying, self._friction.anchors),
            records((Load, Place), acting([axis.load for axis in axes], places)),
            *self.resistances.arrays,
            *(elastic.rows, uneven.rows, uneven.links),
        )
        state = (data.qpos, data.qvel, data.ctrl, data.qfrc_applied)
        constants = (model.dof_frictionloss, model.dof_damping, model.dof_dampingpoly, model.dof_armature, model.dof_M0)
        self.acting = (parts, state, constants)
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
