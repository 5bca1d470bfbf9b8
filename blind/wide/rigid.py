"""Mass matrix and bias of an articulated machine from MuJoCo, called from compiled code without Python in between."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import mujoco
import numpy as np
from numba import types
from numpy.typing import NDArray

from drivetwin.foundation.compiled import compiled

llvm.load_library_permanently(str(next(Path(mujoco.__file__).parent.glob("libmujoco.so*"), "libmujoco.so")))

# A pointer travels as a 64-bit integer, which is how both ABIs that MuJoCo is released for pass it.
_AT = types.int64
_kinematics: Any = types.ExternalFunction("mj_kinematics", types.void(_AT, _AT))
_com_pos: Any = types.ExternalFunction("mj_comPos", types.void(_AT, _AT))
_com_vel: Any = types.ExternalFunction("mj_comVel", types.void(_AT, _AT))
_crb: Any = types.ExternalFunction("mj_crb", types.void(_AT, _AT))
_full_m: Any = types.ExternalFunction("mj_fullM", types.void(_AT, _AT, _AT))
_rne: Any = types.ExternalFunction("mj_rne", types.void(_AT, _AT, types.int32, _AT))

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
