"""Compiles the functions that run at every servo period or sample: numba, typed once here for the checker, cached on disk."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core.errors import NumbaExperimentalFeatureWarning

# A function that is handed to another one is such a feature. Who runs the first command of an installation would read of it.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile `function` to machine code at its first call, with the floating-point rules of IEEE 754 kept.

    It runs without Python's lock: several threads at once, each on arrays of its own.
    """
    return cast(Callable[Parameters, Result], numba.njit(cache=True, fastmath=False, nogil=True)(function))


def in_place(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """As `compiled`, for a function of every servo period, which makes no array: it works on those that it is given.

    So nobody has to count who uses them, which took a tenth of a cycle of three axes.
    """
    uncounted: Any = numba.njit  # whose types do not know `_nrt`, the counting
    return cast(Callable[Parameters, Result], uncounted(cache=True, fastmath=False, nogil=True, _nrt=False)(function))


def settled(function: Callable[Parameters, Result], *arguments: Any) -> Callable[Parameters, Result]:
    """The machine code of a compiled function for arguments of the types of these, which it is not called with.

    For a call in every cycle whose arguments never change their types: numba looks at each of them, in tuples too, before it
    knows which code is meant. Other types raise TypeError.
    """
    dispatcher: Any = function
    types = tuple(dispatcher.typeof_pyval(argument) for argument in arguments)
    dispatcher.compile(types)
    return cast(Callable[Parameters, Result], dispatcher.overloads[types].entry_point)
