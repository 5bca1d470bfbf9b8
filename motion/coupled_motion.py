"""What moves together with the recorded axes: refused where no recording describes it; its friction where one does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import Model

Array = NDArray[np.float64]

_FREE = {int(mujoco.mjtJoint.mjJNT_FREE): "free", int(mujoco.mjtJoint.mjJNT_BALL): "ball"}
_TIES = {
    int(mujoco.mjtEq.mjEQ_CONNECT): "connect",
    int(mujoco.mjtEq.mjEQ_WELD): "weld",
    int(mujoco.mjtEq.mjEQ_TENDON): "tendon",
}
"""Equalities that may close a loop."""
_STEPS = 0.02, 0.1
"""By which each axis is moved to see what holds it [rad or m]."""
_HOLDS = 1e-6
"""By how much more an equality is off, at least, that does not let an axis move [m or rad]."""


def check_axes_move_alone(rigid: Model, joints: Mapping[str, str]) -> None:
    """Raises UserError where an axis moves together with what was not recorded; `joints` are the axes' joints by axis."""
    model, where = rigid.given, str(rigid.path or rigid.name)
    for axis, joint in joints.items():
        _refuse_loose_base(where, model, axis, joint)
    _refuse_loops(where, model, list(joints.values()), rigid)
    ratios = rigid.ratios(list(joints.values()))
    _refuse_springs_that_yield(where, model, ratios)
    _refuse_shared_friction(where, model, list(joints), ratios)


def friction_of_followers(model: mujoco.MjModel, ratios: Array, dofs: Sequence[int]) -> list[tuple[float, float]]:
    """(Coulomb, viscous) on each axis of the joints that follow it and of the tendons that it pulls, its own left out.

    `ratios` (nv, k): how far each joint moves with each axis; `dofs` are those of the axes. By the power that friction takes
    the axis has sum |r| frictionloss, and sum r² damping; damping of tendons stands in MuJoCo's inverse dynamics.
    """
    followers = ratios.copy()
    followers[list(dofs)] = 0.0
    tendons = np.abs(_lengths(model) @ ratios)
    coulomb = np.abs(followers).T @ model.dof_frictionloss + tendons.T @ model.tendon_frictionloss
    viscous = (followers**2).T @ model.dof_damping
    return [(float(level), float(slope)) for level, slope in zip(coulomb, viscous, strict=True)]


def _lengths(model: mujoco.MjModel) -> Array:
    """(ntendon, nv): how much longer each tendon gets with each joint, at qpos0."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    longer = np.zeros((model.ntendon, model.nv))
    if model.ntendon:
        mujoco.mju_sparse2dense(longer, data.ten_J, model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind)
    return longer


def _refuse_loose_base(where: str, model: mujoco.MjModel, axis: str, joint: str) -> None:
    """Nobody recorded how a free base moves, and the axis feels it."""
    for other in _joints_below(model, int(model.jnt_bodyid[model.joint(joint).id])):
        if kind := _FREE.get(int(model.jnt_type[other])):
            name = model.joint(other).name or "without a name"
            body = model.body(int(model.jnt_bodyid[other])).name
            raise UserError(
                f"{where}: axis {axis} is carried by {kind} joint {name} of body {body}, "
                "whose motion is in no recording: take that joint out, and place the body as it stood"
            )


def _joints_below(model: mujoco.MjModel, body: int) -> Iterator[int]:
    """Joints of a body, and of those that carry it."""
    while body:
        yield from range(int(model.body_jntadr[body]), int(model.body_jntadr[body] + model.body_jntnum[body]))
        body = int(model.body_parentid[body])


def _refuse_loops(where: str, model: mujoco.MjModel, joints: Sequence[str], rigid: Model) -> None:
    """An equality that an axis breaks as it moves closes a loop, and moves joints that were not recorded."""
    if not np.isin(model.eq_type, list(_TIES)).any():
        return
    home = np.array([model.qpos0[model.joint(joint).qposadr[0]] for joint in joints])
    at_home = _errors(model, rigid.positions(joints, home[None])[0])
    for k, joint in enumerate(joints):
        for step in _STEPS:
            moved = home + step * np.eye(len(joints))[k]
            off = np.abs(_errors(model, rigid.positions(joints, moved[None])[0]) - at_home)
            if off.max(initial=0.0) > _HOLDS:
                number = int(np.argmax(off))
                kind, name = _TIES[int(model.eq_type[number])], model.equality(number).name or f"number {number}"
                raise UserError(
                    f"{where}: {kind} equality {name} ties joint {joint} to what was not recorded: "
                    "take it out, or say by an equality of joints or fixed tendons what follows"
                )


def _errors(model: mujoco.MjModel, qpos: Array) -> Array:
    """(neq,): by how much each equality that may close a loop is off in a pose, 0 of the others [m or rad, summed]."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    errors = np.zeros(model.neq)
    rows = data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
    for number, error in zip(data.efc_id[rows], data.efc_pos[rows], strict=True):
        errors[number] += abs(error) if int(model.eq_type[number]) in _TIES else 0.0
    return errors


def _refuse_springs_that_yield(where: str, model: mujoco.MjModel, ratios: Array) -> None:
    """Their torque is of the whole motion before, which MuJoCo's inverse dynamics does not know."""
    joints = [
        model.joint(joint).name
        for joint in range(model.njnt)
        if model.jnt_springyield[joint] and ratios[model.jnt_dofadr[joint]].any()
    ]
    pulled = np.abs(_lengths(model) @ ratios).sum(axis=1)
    tendons = [model.tendon(number).name for number in np.flatnonzero(pulled) if model.tendon_springyield[number]]
    if yielding := [*joints, *tendons]:
        raise UserError(f"{where}: the spring of {yielding[0]} yields, and its torque remembers: take its springyield out")


def _refuse_shared_friction(where: str, model: mujoco.MjModel, axes: Sequence[str], ratios: Array) -> None:
    pulls = (_lengths(model) @ ratios).astype(bool)
    for number in range(model.ntendon):
        if model.tendon_frictionloss[number] > 0.0 and pulls[number].sum() > 1:
            shared = ", ".join(axis for axis, is_pulled in zip(axes, pulls[number].tolist(), strict=True) if is_pulled)
            name = model.tendon(number).name or f"number {number}"
            raise UserError(f"{where}: tendon {name} has one frictionloss on axes {shared}: give the joint of each its own")
