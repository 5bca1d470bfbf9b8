"""Mass matrix and bias of an articulated machine from MuJoCo, called from compiled code without Python in between."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numba import types
from numpy.typing import NDArray

from drivetwin.foundation.compiled import compiled
from drivetwin.foundation.mujoco_calls import ADDRESS, mujoco_call

_kinematics = mujoco_call("mj_kinematics", ADDRESS, ADDRESS)
_com_pos = mujoco_call("mj_comPos", ADDRESS, ADDRESS)
_com_vel = mujoco_call("mj_comVel", ADDRESS, ADDRESS)
_crb = mujoco_call("mj_crb", ADDRESS, ADDRESS)
_full_m = mujoco_call("mj_fullM", ADDRESS, ADDRESS, ADDRESS)
_rne = mujoco_call("mj_rne", ADDRESS, ADDRESS, types.int32, ADDRESS)

Array = NDArray[np.float64]


@compiled
def mass_and_bias(model: int, data: int, mass: Array, bias: Array) -> None:
    """Fill `mass` (nv, nv) and `bias` (nv,) (Coriolis, centrifugal, weight) at the state that `data` holds."""
    _kinematics(model, data)
    _com_pos(model, data)
    _crb(model, data)
    _full_m(model, data, mass.ctypes.data)
    _com_vel(model, data)
    _rne(model, data, 0, bias.ctypes.data)


@dataclass(frozen=True)
class RigidBodies:
    """A model whose n joints are its axes in order: addresses of model and data, views of the state, room for the result."""

    model: mujoco.MjModel
    data: mujoco.MjData
    mass: Array
    bias: Array

    @property
    def addresses(self) -> tuple[int, int]:
        """Of model and data in memory."""
        return self.model._address, self.data._address


def rigid_bodies(xml: str) -> RigidBodies:
    """The rigid bodies of a model of hinges and slides, without the rotors (`armature`), which belong to the motors."""
    spec = mujoco.MjSpec.from_string(xml)
    for joint in spec.joints:
        joint.armature = 0.0
    model = spec.compile()
    return RigidBodies(model, mujoco.MjData(model), np.zeros((model.nv, model.nv)), np.zeros(model.nv))
