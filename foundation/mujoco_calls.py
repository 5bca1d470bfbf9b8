"""Functions of MuJoCo's library for compiled code, called without Python in between."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import mujoco
from numba import types

llvm.load_library_permanently(str(next(Path(mujoco.__file__).parent.glob("libmujoco.so*"), "libmujoco.so")))

ADDRESS = types.int64
"""A pointer travels as a 64-bit integer, which is how both ABIs that MuJoCo is released for pass it."""


def mujoco_call(name: str, *arguments: types.Type) -> Any:
    """The function of that name, of arguments of these types and without a result."""
    return types.ExternalFunction(name, types.void(*arguments))


mj_step = mujoco_call("mj_step", ADDRESS, ADDRESS)
"""One step of a model's data, by the addresses of both."""


def stop_clocks() -> None:
    """Let MuJoCo no longer time the parts of its steps (`mjData.timer`, which nothing here reads) in this process.

    Its package for Python has a clock set (`mjcb_time`), which takes a fifth of a step of three axes, and `set_mjcb_time(None)`
    sets that one again.
    """
    ctypes.c_void_p.from_address(llvm.address_of_symbol("mjcb_time")).value = None
