"""Machines from models of real robots that a user has: their rigid bodies and ranges, bare of pictures and contacts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from drivetwin.blind.wide.machines import AxisLimits, Draw, Known, Link, Machine, equipped, hinge_limits, slide_limits
from drivetwin.foundation.errors import UserError

ROBOTS = "robots"
"""Name of the family of all models in a folder."""

MOST = 7
"""Axes of a machine."""

_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)


@cache
def robot_files(directory: Path) -> tuple[str, ...]:
    """`robots/PATH` of every MJCF below `directory` that compiles and whose motors drive hinges or slides of one chain.

    Raises UserError where there is none.
    """
    found = []
    for path in sorted(directory.rglob("*.xml")):
        model = _compiled(path)
        if model is not None and _longest_chain(model):
            found.append(f"{ROBOTS}/{path.relative_to(directory)}")
    if not found:
        raise UserError(f"--robots {directory}: no MJCF in it has motors on hinges or slides; give a folder of robot models")
    return tuple(found)


def draw_robot(draw: Draw, family: str, directory: Path) -> Machine:
    """The robot `family` of `robot_files`; motors, gears and what friction the model lacks are drawn."""
    model = _compiled(directory / family.removeprefix(f"{ROBOTS}/"))
    if model is None:
        raise UserError(f"--robots {directory}: {family} does not compile any more; leave the folder as it was")
    joints = _longest_chain(model)
    links, limits = _links(model, joints), [_limits(draw, model, joint) for joint in joints]
    return equipped(draw, family, links, limits, [_known(model, joint) for joint in joints])


def _known(model: mujoco.MjModel, joint: int) -> Known:
    dof = model.jnt_dofadr[joint]
    return Known(float(model.dof_frictionloss[dof]), float(model.dof_armature[dof]))


@cache
def _compiled(path: Path) -> mujoco.MjModel | None:
    """The model of a file; None where it is no model on its own (a part that others include)."""
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return None


def _longest_chain(model: mujoco.MjModel) -> list[int]:
    """Driven hinges and slides from the world outwards, on the way to the body with most of them; the first `MOST`."""
    driven = {
        int(model.actuator_trnid[k, 0])
        for k in range(model.nu)
        if int(model.actuator_trntype[k]) == int(mujoco.mjtTrn.mjTRN_JOINT)
    }
    turning = (int(mujoco.mjtJoint.mjJNT_HINGE), _SLIDE)
    driven = {joint for joint in driven if int(model.jnt_type[joint]) in turning}
    chains: dict[int, list[int]] = {0: []}
    for body in range(1, model.nbody):
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        own = [joint for joint in range(first, first + count) if joint in driven]
        chains[body] = chains[int(model.body_parentid[body])] + own
    return max(chains.values(), key=len)[:MOST]


def _links(model: mujoco.MjModel, joints: Sequence[int]) -> list[Link]:
    """A link a joint, its frame at the joint's anchor and parallel to the world at qpos0; bodies between joints are one."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    owner = {0: -1}
    for body in range(1, model.nbody):
        own = [k for k, joint in enumerate(joints) if model.jnt_bodyid[joint] == body]
        owner[body] = own[-1] if own else owner[int(model.body_parentid[body])]
    links = []
    for k, joint in enumerate(joints):
        bodies = [body for body, link in owner.items() if link == k]
        mass, com, inertia = _together(model, data, bodies)
        before = data.xanchor[joints[k - 1]] if k else np.zeros(3)
        links.append(
            Link(
                name=f"axis{k + 1}",
                parent=k - 1,
                place=_vector(data.xanchor[joint] - before),
                axis=_vector(data.xaxis[joint]),
                slide=int(model.jnt_type[joint]) == _SLIDE,
                mass=mass,
                com=_vector(com - data.xanchor[joint]) if bodies else (0.0, 0.0, 0.0),
                inertia=inertia,
            )
        )
    return links


def _vector(values: Any) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


def _together(model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[int]) -> tuple[float, Any, tuple[float, ...]]:
    """Mass, centre and inertia about it of several bodies, along the world's axes; next to nothing of none."""
    mass = float(sum(model.body_mass[body] for body in bodies))
    if mass < 1e-6:
        return 1e-6, np.zeros(3) if not bodies else data.xipos[bodies[0]], (1e-9, 1e-9, 1e-9)
    com = sum(model.body_mass[body] * data.xipos[body] for body in bodies) / mass
    total = np.zeros((3, 3))
    for body in bodies:
        turn, apart = data.ximat[body].reshape(3, 3), data.xipos[body] - com
        total += turn @ np.diag(model.body_inertia[body]) @ turn.T
        total += model.body_mass[body] * (apart @ apart * np.eye(3) - np.outer(apart, apart))
    total += 1e-9 * np.eye(3)
    return mass, com, tuple(float(total[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def _limits(draw: Draw, model: mujoco.MjModel, joint: int) -> AxisLimits:
    """The joint's range counted from qpos0, at most 3 rad of it around its middle; 1.5 rad either way where it has none."""
    at = float(model.qpos0[model.jnt_qposadr[joint]])
    slide = int(model.jnt_type[joint]) == _SLIDE
    low, high = (float(value) - at for value in model.jnt_range[joint])
    if not model.jnt_limited[joint]:
        low, high = (-0.2, 0.2) if slide else (-1.5, 1.5)
    middle, half = (low + high) / 2.0, min((high - low) / 2.0, 1e9 if slide else 1.5)
    draw_limits = slide_limits if slide else hinge_limits
    return draw_limits(draw, middle - 0.95 * half, middle + 0.95 * half)
