"""The simulation's own dynamics, without friction: the torque that a measured motion needs.

    tau_axis = sum over joints j of (d q_j / d q_axis) tau_j,    tau = M(q) a + C(q, v) + g(q) + springs

Passive joints follow by equalities of joints and of fixed tendons (followers.py).
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from enum import Enum
from pathlib import Path

import mujoco
import numpy as np
from numpy.polynomial import polynomial

from drivetwin.foundation.compiled import compiled
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.mujoco_calls import ADDRESS, mujoco_call, stop_clocks
from drivetwin.motion.compilation import check_compiles
from drivetwin.motion.followers import Follower, followers, relations_of
from drivetwin.recording.recording import Samples


class JointKind(Enum):
    """What a joint moves, and thereby the units of everything on it."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


_ONE_DEGREE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


_ON_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))

_inverse = mujoco_call("mj_inverse", ADDRESS, ADDRESS)

_STATES = 16
"""States in the motion's range, and as many at its corners, at which the torque must be affine to count as such."""


@compiled
def _needed(model: int, data: int, own: tuple[Samples, ...], motion: tuple[Samples, ...], torque: Samples) -> None:
    """mj_inverse of each row of `motion` (qpos, qvel, qacc) into `torque` (n, nv); `own`: these and qfrc_inverse of `data`."""
    q, v, a, needed = own
    qpos, qvel, qacc = motion
    for row in range(torque.shape[0]):
        q[:], v[:], a[:] = qpos[row], qvel[row], qacc[row]
        _inverse(model, data)
        torque[row] = needed


class Model:
    """A MuJoCo model seen from its motors: inverse dynamics of the recorded axes, friction and limits left out.

    `given` is the model as MuJoCo has it.
    """

    def __init__(self, mj_model: mujoco.MjModel, path: Path | None = None) -> None:
        self.path = path
        self.name: str = mj_model.names.split(b"\0", 1)[0].decode() or (path.stem if path else "model")
        self.given = mj_model
        self._mj = _frictionless(mj_model)
        stop_clocks()
        self._relations = relations_of(mj_model)
        self._joints = {
            mj_model.joint(index).name: index for index in range(mj_model.njnt) if int(mj_model.jnt_type[index]) in _ONE_DEGREE
        }
        self._home: Samples = mj_model.qpos0.copy()

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the hinge and slide joints."""
        return tuple(self._joints)

    def kind(self, joint: str) -> JointKind:
        """Whether `joint` turns or slides."""
        slides = int(self._mj.jnt_type[self._index(joint)]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
        return JointKind.PRISMATIC if slides else JointKind.REVOLUTE

    def inertia(self, joint: str) -> float:
        """d torque / d acceleration of the axis at qpos0 [kg·m² or kg], motor and passive joints included."""
        position = np.full((2, 1), self._home[self._mj.jnt_qposadr[self._index(joint)]])
        torque = self._loop([joint], position, np.zeros((2, 1)), np.array([[0.0], [1.0]]))
        return float(torque[1, 0] - torque[0, 0])

    def torques(self, joints: Sequence[str], position: Samples, velocity: Samples, acceleration: Samples) -> Samples:
        """Frictionless torque of each axis for a motion of all of them.

        `position`, `velocity`, `acceleration` and the result are (n, k), one column for each of the k `joints`, in SI
        units. Joints that are neither named nor followers of a named one stand at qpos0.
        """
        affine = self._affine(joints, position, velocity, acceleration)
        if affine is not None:
            inertia, constant = affine
            return acceleration @ inertia.T + constant
        return self._loop(joints, position, velocity, acceleration)

    def positions(self, joints: Sequence[str], position: Samples) -> Samples:
        """qpos (n, nq) of the whole model for positions (n, k) of the joints."""
        rest = np.zeros_like(position)
        qpos, _, _, _ = self._moved(joints, position, rest, rest)
        return qpos

    def ratios(self, joints: Sequence[str]) -> Samples:
        """(nv, k): how far every joint of the model moves with each of `joints`, at qpos0; 0 for what is no hinge or slide."""
        home = self._home[[self._mj.jnt_qposadr[self._index(joint)] for joint in joints]][None]
        rest = np.zeros_like(home)
        _, _, _, reduction = self._moved(joints, home, rest, rest)
        return np.asarray(reduction[0])

    def _affine(
        self, joints: Sequence[str], position: Samples, velocity: Samples, acceleration: Samples
    ) -> tuple[Samples, Samples] | None:
        """(inertia (k, k), constant (k,)) where the torque is inertia a + constant, whatever the motion within its range.

        Torque is an analytic function of the state, but for tendons that wrap or go slack. One that agrees with an affine one
        at states drawn at random from a box agrees with it in the whole box, be there samples of the motion near them or not.
        """
        if self._mj.ntendon and self._bent_tendons():
            return None
        count = len(joints)
        rng = np.random.default_rng(0)
        states = [_drawn(rng, values) for values in (position, velocity, acceleration)]
        probes = np.vstack([np.zeros(count), np.eye(count)])
        at_first = self._loop(joints, np.tile(position[:1], (count + 1, 1)), np.zeros((count + 1, count)), probes)
        constant = at_first[0]
        inertia = (at_first[1:] - constant).T
        torque = self._loop(joints, *states)
        scale = float(np.abs(torque).max()) + 1e-12
        fits = bool(np.abs(states[2] @ inertia.T + constant - torque).max() <= 1e-9 * scale)
        return (inertia, constant) if fits else None

    def _bent_tendons(self) -> bool:
        """Whether a tendon's force may have a bend: where it wraps, or between the lengths at which its spring is slack."""
        fixed = self._mj.tendon_type == int(mujoco.mjtTendon.mjTENDON_FIXED)
        return bool((~fixed | (self._mj.tendon_stiffness != 0.0)).any())

    def _loop(self, joints: Sequence[str], position: Samples, velocity: Samples, acceleration: Samples) -> Samples:
        """mj_inverse sample by sample; shapes as in `torques`."""
        mj, data = self._mj, mujoco.MjData(self._mj)
        qpos, qvel, qacc, reduction = self._moved(joints, position, velocity, acceleration)
        torque = np.empty((len(position), mj.nv))
        own = (data.qpos, data.qvel, data.qacc, data.qfrc_inverse)
        _needed(mj._address, data._address, own, (qpos, qvel, qacc), torque)
        return np.asarray(np.einsum("nv,nvk->nk", torque, reduction), dtype=np.float64)

    def _moved(
        self, joints: Sequence[str], position: Samples, velocity: Samples, acceleration: Samples
    ) -> tuple[Samples, Samples, Samples, Samples]:
        """qpos (n, nq), qvel and qacc (n, nv) of the whole model, and how far each joint moves with each axis (n, nv, k)."""
        mj, rows = self._mj, len(position)
        qpos = np.tile(self._home, (rows, 1))
        qvel, qacc = np.zeros((rows, mj.nv)), np.zeros((rows, mj.nv))
        reduction = np.zeros((rows, mj.nv, len(joints)))
        indices = [self._index(joint) for joint in joints]
        for column, index in enumerate(indices):
            qpos[:, mj.jnt_qposadr[index]] = position[:, column]
            qvel[:, mj.jnt_dofadr[index]] = velocity[:, column]
            qacc[:, mj.jnt_dofadr[index]] = acceleration[:, column]
            reduction[:, mj.jnt_dofadr[index], column] = 1.0
        for link in followers(mj, self._relations, indices):
            self._follow(link, qpos, qvel, qacc, reduction)
        return qpos, qvel, qacc, reduction

    def _follow(self, link: Follower, qpos: Samples, qvel: Samples, qacc: Samples, reduction: Samples) -> None:
        """Fill in the follower's columns from its leaders': v_j = p' d', a_j = p' d'' + p'' d'^2, d as in `Follower`."""
        mj = self._mj
        lead_q, lead_v = mj.jnt_qposadr[list(link.leaders)], mj.jnt_dofadr[list(link.leaders)]
        own_q, own_v = mj.jnt_qposadr[link.joint], mj.jnt_dofadr[link.joint]
        turned = (qpos[:, lead_q] - self._home[lead_q]) @ link.weights
        speed = qvel[:, lead_v] @ link.weights
        slope = polynomial.polyval(turned, polynomial.polyder(link.coefficients))
        bend = polynomial.polyval(turned, polynomial.polyder(link.coefficients, 2))
        qpos[:, own_q] = self._home[own_q] + polynomial.polyval(turned, link.coefficients)
        qvel[:, own_v] = slope * speed
        qacc[:, own_v] = slope * (qacc[:, lead_v] @ link.weights) + bend * speed**2
        reduction[:, own_v] = slope[:, None] * np.einsum("nmk,m->nk", reduction[:, lead_v], link.weights)

    def _index(self, joint: str) -> int:
        if joint not in self._joints:
            raise UserError(
                f"the model {self.path or self.name} has no hinge or slide joint '{joint}'; it has: {', '.join(self._joints)}"
            )
        return self._joints[joint]


def load_model(path: Path) -> Model:
    """Read an MJCF file. Raises UserError where it is missing or MuJoCo refuses it."""
    return Model(read_mjcf(path), path)


def read_mjcf(path: Path) -> mujoco.MjModel:
    """MuJoCo's own model of an MJCF file; raises as `load_model`, and where it takes too long or its numbers are no model."""
    check_compiles(path)
    return mujoco.MjModel.from_xml_path(str(path))


def _drawn(rng: np.random.Generator, values: Samples) -> Samples:
    """(2 _STATES, k): points of the box that the columns of `values` (n, k) span, and corners of it."""
    low, high = values.min(axis=0), values.max(axis=0)
    shares = rng.random((2 * _STATES, values.shape[1]))
    shares[_STATES:] = np.round(shares[_STATES:])
    return np.asarray(low + shares * (high - low), dtype=np.float64)


def _frictionless(mj_model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy whose inverse dynamics has no friction of joints and motors, no constraint and no contact; continuous in time."""
    bit = mujoco.mjtDisableBit
    mj = copy.copy(mj_model)
    for flag in (bit.mjDSBL_CONSTRAINT, bit.mjDSBL_CONTACT, bit.mjDSBL_SENSOR, bit.mjDSBL_ACTUATION):
        mj.opt.disableflags |= int(flag)
    mj.opt.enableflags = 0
    mj.dof_damping[:] = 0.0
    mj.dof_dampingpoly[:] = 0.0
    mj.dof_frictionloss[:] = 0.0
    on_joints = np.isin(mj.actuator_trntype, _ON_JOINT)
    mj.actuator_damping[on_joints] = 0.0
    mj.actuator_dampingpoly[on_joints] = 0.0
    return mj
