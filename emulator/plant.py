"""The plant: a MuJoCo model with motors, gears and the machine's true effects, moved by the drives' torque."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.errors import UserError
from emulator.compiled import compiled
from emulator.drive.servo import SERVO_PERIOD, ServoBank
from emulator.effects import FrictionLaw, PlacedEffect
from emulator.machine import Machine

LAW = np.dtype([(field.name, "f8") for field in fields(FrictionLaw)] + [("brake", "f8"), ("dof", "i8")])


@compiled
def apply_friction(laws, braked, velocity, frictionloss, applied) -> None:  # type: ignore[no-untyped-def]
    """Set what MuJoCo's friction constraint may hold and what acts beside it, for laws (n,), from qvel (nv,).

    Native `frictionloss` does the sticking and, once a limit is reached, gives exactly that limit; the law only moves the
    limit with the speed. A limit that differs with the direction is a symmetric one beside a constant torque.
    """
    for axis in range(laws.shape[0]):
        law = laws[axis]
        speed = abs(velocity[law.dof])
        level = law.coulomb
        if law.stribeck_velocity > 0.0:
            level += (law.static_torque - law.coulomb) * np.exp(-((speed / law.stribeck_velocity) ** law.exponent))
        frictionloss[law.dof] = level + (law.brake if braked[axis] else 0.0)
        applied[law.dof] = -law.coulomb_asymmetry - law.viscous_asymmetry * speed


@compiled
def read_motors(gear, qpos_index, qpos, motor_position) -> None:  # type: ignore[no-untyped-def]
    """Motor angles (n,) [rad] from joint positions."""
    for axis in range(gear.shape[0]):
        motor_position[axis] = gear[axis] * qpos[qpos_index[axis]]


class Plant:
    """MuJoCo model and state of one machine, stepped at the servo period.

    Knows the truth. Drives see it through `motor_position` only; nothing here is reachable from the bus.
    """

    def __init__(self, machine: Machine, effects: tuple[PlacedEffect, ...]) -> None:
        spec = mujoco.MjSpec.from_file(str(machine.model_path))
        spec.option.timestep = SERVO_PERIOD
        laws = _prepare(spec, machine, effects)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        axes = machine.axes.values()
        joints = [self.model.joint(axis.joint) for axis in axes]
        self._gear = np.array([axis.gear_ratio for axis in axes])
        self._qpos_index = np.array([joint.qposadr[0] for joint in joints])
        self._dof_index = np.array([joint.dofadr[0] for joint in joints])
        self._actuator_index = np.array([self.model.actuator(axis.actuator).id for axis in axes])
        self._laws = _pack(laws, machine, self._dof_index)
        self._laws_by_axis = dict(zip(machine.axes, laws, strict=True))
        self.motor_position = np.zeros(len(joints))
        self.motor_torque = np.zeros(len(joints))
        self._place(machine)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    def joint_positions(self) -> NDArray[np.float64]:
        """True joint positions (n,) [rad or m]; for the limit switches and the tests."""
        return np.asarray(self.data.qpos[self._qpos_index])

    def joint_velocities(self) -> NDArray[np.float64]:
        """True joint velocities (n,) [rad/s or m/s]."""
        return np.asarray(self.data.qvel[self._dof_index])

    def advance(self, servos: ServoBank) -> None:
        """Run `servos.periods` servo periods: encoder, loops, torque, friction, one step of the plant each."""
        data, model = self.data, self.model
        braked = servos.loops == 0
        for period in range(servos.periods):
            read_motors(self._gear, self._qpos_index, data.qpos, self.motor_position)
            servos.run(period, self.motor_position, self.motor_torque)
            data.ctrl[self._actuator_index] = self.motor_torque
            apply_friction(self._laws, braked, data.qvel, model.dof_frictionloss, data.qfrc_applied)
            mujoco.mj_step(model, data)

    def truth(self) -> dict[str, dict[str, float]]:
        """True parameters of each axis: inertia at qpos0 (motor included) and friction; joint side, SI.

        Told only by the emulator's owner, after a fit; never on the bus.
        """
        inertia = self._axis_inertia()
        return {
            name: {"inertia": float(inertia[axis]), **told(law)} for axis, (name, law) in enumerate(self._laws_by_axis.items())
        }

    def _axis_inertia(self) -> NDArray[np.float64]:
        """d torque / d acceleration at qpos0, with the joints that follow by an equality."""
        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, mass)
        motion = followers(self.model)[:, self._dof_index]
        return np.asarray(np.einsum("ia,ij,ja->a", motion, mass, motion))

    def _place(self, machine: Machine) -> None:
        for index, axis in zip(self._qpos_index, machine.axes.values(), strict=True):
            self.data.qpos[index] = axis.power_on_position
        motion = followers(self.model)
        moved = np.zeros(self.model.nv)
        moved[self._dof_index] = (self.data.qpos - self.model.qpos0)[self._qpos_index]
        self.data.qpos[:] = self.model.qpos0 + motion @ moved
        mujoco.mj_forward(self.model, self.data)
        read_motors(self._gear, self._qpos_index, self.data.qpos, self.motor_position)


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


def told(law: FrictionLaw) -> dict[str, float]:
    """A friction law by the names that an identification uses; Stribeck's only where the law has it."""
    names = {
        "coulomb": law.coulomb,
        "viscous": law.viscous,
        "coulomb_positive": law.coulomb + law.coulomb_asymmetry,
        "coulomb_negative": law.coulomb - law.coulomb_asymmetry,
        "viscous_positive": law.viscous + law.viscous_asymmetry,
        "viscous_negative": law.viscous - law.viscous_asymmetry,
    }
    if law.stribeck_velocity > 0.0:
        names |= {
            "static_torque": law.static_torque,
            "stribeck_velocity": law.stribeck_velocity,
            "exponent": law.exponent,
        }
    return names


def _prepare(spec: mujoco.MjSpec, machine: Machine, effects: tuple[PlacedEffect, ...]) -> list[FrictionLaw]:
    """Put motors, gears and effects into the specification; the friction law of each axis, in the machine's order."""
    if unknown := {placed.axis for placed in effects} - set(machine.axes):
        raise UserError(
            f"the effects name axis {sorted(unknown)[0]!r}; machine {machine.machine} has {', '.join(machine.axes)}"
        )
    laws = []
    for name, axis in machine.axes.items():
        joint = spec.joint(axis.joint)
        joint.armature += axis.motor.inertia * axis.gear_ratio**2
        spec.actuator(axis.actuator).gear[0] = axis.gear_ratio
        law = FrictionLaw()
        for placed in effects:
            if placed.axis == name:
                _check_units(placed, joint)
                law = placed.effect.add_to(spec, joint, law)
        _check_resists(name, law)
        joint.damping[0] = law.viscous
        joint.frictionloss = law.coulomb
        laws.append(law)
    return laws


def _check_units(placed: PlacedEffect, joint: mujoco.MjsJoint) -> None:
    for parameter in placed.effect.parameters:
        expected = parameter.unit.on(joint.type)
        given = placed.units.get(parameter.name, expected)
        if given != expected:
            raise UserError(
                f"{placed.effect.name} on axis {placed.axis!r}: {parameter.name} is given in {given!r}, expected {expected!r}"
            )


def _check_resists(axis: str, law: FrictionLaw) -> None:
    """Friction that is negative in one direction would drive the joint."""
    for name in ("coulomb", "viscous"):
        level, asymmetry = getattr(law, name), getattr(law, f"{name}_asymmetry")
        if abs(asymmetry) > level:
            raise UserError(f"axis {axis}: {name}_asymmetry {asymmetry:g} is more than {name} {level:g}: it would push")


def _pack(laws: list[FrictionLaw], machine: Machine, dofs: NDArray[np.int64]) -> NDArray[np.void]:
    packed = np.zeros(len(laws), dtype=LAW)
    for row, law, axis, dof in zip(packed, laws, machine.axes.values(), dofs, strict=True):
        for field in fields(FrictionLaw):
            row[field.name] = getattr(law, field.name)
        row["brake"] = axis.motor.holding_brake * axis.gear_ratio
        row["dof"] = dof
    return packed


def truth_path(machine: Machine, given: Path | None) -> Path:
    """The effects file that is the plant's truth: the given one, or the machine's own."""
    return given if given is not None else machine.effects_path
