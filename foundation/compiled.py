"""Compiles the functions that run at every servo period or sample: numba, typed once here for the checker, cached on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile `function` to machine code at its first call, with the floating-point rules of IEEE 754 kept.

    It runs without Python's lock: several threads at once, each on arrays of its own.
    """
    return cast(Callable[Parameters, Result], numba.njit(cache=True, fastmath=False, nogil=True)(function))
