"""The same floating-point results on every x86-64 processor: what a process needs in its environment before it starts.

Three libraries choose their code by the processor, and the last bit of a result with it: the C library (sin, exp, pow, with or
without fused multiply-add), numpy (vector instructions) and OpenBLAS (kernels). Each is told to use what every processor has.
Functions that `compiled` makes need nothing: without fastmath LLVM neither fuses nor reorders.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

_GLIBC = "glibc.cpu.hwcaps=-FMA,-FMA4,-FMA_Usable,-FMA4_Usable"
"""glibc manual, 'Hardware Capability Tunables'; before glibc 2.33 the names ended in _Usable."""


def common_arithmetic() -> dict[str, str]:
    """Environment of a process whose results are those of any x86-64 host with the same C library and packages."""
    vectors = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "GLIBC_TUNABLES": _with_tunable(os.environ.get("GLIBC_TUNABLES", "")),
        "NPY_DISABLE_CPU_FEATURES": " ".join([*vectors.get("found", ()), *vectors.get("not found", ())]),
        "OPENBLAS_CORETYPE": "Prescott",
        "OPENBLAS_NUM_THREADS": "1",
    }


@contextmanager
def children_compute_alike() -> Iterator[None]:
    """Processes that are started within the block have `common_arithmetic`; this one, which has started, keeps its own."""
    wanted = common_arithmetic()
    former = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in former.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _with_tunable(given: str) -> str:
    """The user's own tunables, but for the processor's."""
    others = [one for one in given.split(":") if one and not one.startswith("glibc.cpu.hwcaps=")]
    return ":".join([*others, _GLIBC])
