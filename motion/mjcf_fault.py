"""What keeps an MJCF file from being a model; as a program, `python mjcf_fault.py MODEL.xml`, it writes that to stdout."""

from __future__ import annotations

import sys

import mujoco
import numpy as np

LONGEST = 300
"""Characters of an error that are told."""
_FINITE = ("body_mass", "body_inertia", "body_ipos", "dof_armature", "dof_damping", "dof_frictionloss")


def fault(path: str) -> str:
    """What is wrong with a file, to follow its name; empty where nothing is."""
    try:
        model = mujoco.MjModel.from_xml_path(path)
    except (ValueError, RuntimeError, mujoco.FatalError, MemoryError) as error:
        return f"is not a MuJoCo model: {error}"[:LONGEST]
    return _not_text(model) or _not_finite(model) or _no_torque(model)


def _not_text(model: mujoco.MjModel) -> str:
    try:
        bytes(model.names).decode("utf-8")
    except UnicodeDecodeError as error:
        return f"has a name that is not UTF-8 (byte {error.object[error.start]:02X}h): save it as UTF-8"
    return ""


def _not_finite(model: mujoco.MjModel) -> str:
    for name in _FINITE:
        values = getattr(model, name).reshape(len(getattr(model, name)), -1)
        wrong = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if wrong.size:
            body = int(wrong[0]) if name.startswith("body") else int(model.dof_bodyid[wrong[0]])
            return f"has no finite {name.split('_')[1]} on body {model.body(body).name or body}: correct it"
    return ""


def _no_torque(model: mujoco.MjModel) -> str:
    data = mujoco.MjData(model)
    mujoco.mj_inverse(model, data)
    wrong = np.flatnonzero(~np.isfinite(data.qfrc_inverse))
    if not wrong.size:
        return ""
    joint = int(model.dof_jntid[wrong[0]])
    return f"asks for no finite torque of joint {model.joint(joint).name or joint} at its qpos0: correct what it moves"


if __name__ == "__main__":
    sys.stdout.write(fault(sys.argv[1]))
