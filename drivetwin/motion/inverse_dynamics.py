"""The simulation's own dynamics, without friction: the torque that a measured motion needs.

    tau_axis = sum over joints j of (d q_j / d q_axis) tau_j,    tau = M(q) a + C(q, v) + g(q) + springs

Passive joints follow by MuJoCo joint equalities q_j = qpos0_j + p(q_i - qpos0_i), p of degree 4.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import mujoco
import numpy as np
from numpy.polynomial import polynomial

from drivetwin.errors import UserError
from drivetwin.recording.recording import Samples


class JointKind(Enum):
    """What a joint moves, and thereby the units of everything on it."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


_ONE_DEGREE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


@dataclass(frozen=True)
class _Follower:
    """Joint `follower` obeys q = qpos0 + p(q_leader - qpos0_leader); `coefficients` of p, constant first, (5,)."""

    follower: int
    leader: int
    coefficients: Samples


class Model:
    """A MuJoCo model seen from its motors: inverse dynamics of the recorded axes, friction and limits left out."""

    def __init__(self, mj_model: mujoco.MjModel, path: Path | None = None) -> None:
        self.path = path
        self.name: str = mj_model.names.split(b"\0", 1)[0].decode() or (path.stem if path else "model")
        self._mj = _frictionless(mj_model)
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

    def _affine(
        self, joints: Sequence[str], position: Samples, velocity: Samples, acceleration: Samples
    ) -> tuple[Samples, Samples] | None:
        """(inertia (k, k), constant (k,)) where the torque is inertia a + constant on a sample of the motion."""
        count = len(joints)
        pick = np.linspace(0, len(position) - 1, 64).astype(int)
        q, v, a = position[pick], velocity[pick], acceleration[pick]
        probes = np.vstack([np.zeros(count), np.eye(count)])
        at_first = self._loop(joints, np.tile(q[0], (count + 1, 1)), np.zeros((count + 1, count)), probes)
        constant = at_first[0]
        inertia = (at_first[1:] - constant).T
        torque = self._loop(joints, q, v, a)
        scale = float(np.abs(torque).max()) + 1e-12
        fits = bool(np.abs(a @ inertia.T + constant - torque).max() <= 1e-9 * scale)
        return (inertia, constant) if fits else None

    def _loop(self, joints: Sequence[str], position: Samples, velocity: Samples, acceleration: Samples) -> Samples:
        """mj_inverse sample by sample; shapes as in `torques`."""
        mj, data = self._mj, mujoco.MjData(self._mj)
        rows = len(position)
        qpos = np.tile(self._home, (rows, 1))
        qvel, qacc = np.zeros((rows, mj.nv)), np.zeros((rows, mj.nv))
        reduction = np.zeros((rows, mj.nv, len(joints)))
        for column, joint in enumerate(joints):
            index = self._index(joint)
            qpos[:, mj.jnt_qposadr[index]] = position[:, column]
            qvel[:, mj.jnt_dofadr[index]] = velocity[:, column]
            qacc[:, mj.jnt_dofadr[index]] = acceleration[:, column]
            reduction[:, mj.jnt_dofadr[index], column] = 1.0
        for link in self._links(joints):
            self._follow(link, qpos, qvel, qacc, reduction)
        torque = np.empty((rows, mj.nv))
        q, v, a, needed = data.qpos, data.qvel, data.qacc, data.qfrc_inverse
        inverse = mujoco.mj_inverse
        # each turn of the loop writes a row into MuJoCo's own arrays
        for q[:], v[:], a[:], row in zip(qpos, qvel, qacc, torque, strict=True):
            inverse(mj, data)
            row[:] = needed
        return np.asarray(np.einsum("nv,nvk->nk", torque, reduction), dtype=np.float64)

    def _follow(self, link: _Follower, qpos: Samples, qvel: Samples, qacc: Samples, reduction: Samples) -> None:
        """Fill in the follower's columns from its leader's: v_j = p' v_i, a_j = p' a_i + p'' v_i^2."""
        mj = self._mj
        lead_q, lead_v = mj.jnt_qposadr[link.leader], mj.jnt_dofadr[link.leader]
        own_q, own_v = mj.jnt_qposadr[link.follower], mj.jnt_dofadr[link.follower]
        turned = qpos[:, lead_q] - self._home[lead_q]
        slope = polynomial.polyval(turned, polynomial.polyder(link.coefficients))
        bend = polynomial.polyval(turned, polynomial.polyder(link.coefficients, 2))
        qpos[:, own_q] = self._home[own_q] + polynomial.polyval(turned, link.coefficients)
        qvel[:, own_v] = slope * qvel[:, lead_v]
        qacc[:, own_v] = slope * qacc[:, lead_v] + bend * qvel[:, lead_v] ** 2
        reduction[:, own_v] = slope[:, None] * reduction[:, lead_v]

    def _links(self, joints: Sequence[str]) -> list[_Follower]:
        """The joint equalities in an order in which every leader is known before its follower."""
        mj = self._mj
        waiting = [
            _Follower(int(mj.eq_obj1id[k]), int(mj.eq_obj2id[k]), mj.eq_data[k, :5].copy())
            for k in range(mj.neq)
            if int(mj.eq_type[k]) == int(mujoco.mjtEq.mjEQ_JOINT) and mj.eq_active0[k] and mj.eq_obj2id[k] >= 0
        ]
        known = {self._index(joint) for joint in joints}
        ordered: list[_Follower] = []
        while waiting:
            ready = [turn for link in waiting if (turn := _towards(link, known)) is not None]
            if not ready:
                break
            ordered.append(ready[0])
            known.add(ready[0].follower)
            ends = {ready[0].follower, ready[0].leader}
            waiting = [link for link in waiting if {link.follower, link.leader} != ends]
        return ordered

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
    """MuJoCo's own model of an MJCF file; raises as `load_model`."""
    if not path.is_file():
        raise UserError(f"no model at {path}: give the path of a MuJoCo XML file")
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise UserError(f"{path} is not a MuJoCo model: {error}") from error


def _towards(link: _Follower, known: set[int]) -> _Follower | None:
    """`link` so that its leader is known and its follower is not; turned round where it is a straight line."""
    if link.leader in known and link.follower not in known:
        return link
    constant, slope = link.coefficients[:2]
    if link.follower in known and link.leader not in known and slope and not link.coefficients[2:].any():
        return _Follower(link.leader, link.follower, np.array([-constant / slope, 1.0 / slope, 0.0, 0.0, 0.0]))
    return None


def _frictionless(mj_model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy whose inverse dynamics has neither friction, damping, constraints nor contacts."""
    bit = mujoco.mjtDisableBit
    mj = copy.copy(mj_model)
    for flag in (bit.mjDSBL_CONSTRAINT, bit.mjDSBL_CONTACT, bit.mjDSBL_SENSOR, bit.mjDSBL_ACTUATION):
        mj.opt.disableflags |= int(flag)
    mj.dof_damping[:] = 0.0
    mj.dof_dampingpoly[:] = 0.0
    mj.dof_frictionloss[:] = 0.0
    return mj
