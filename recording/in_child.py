"""Reads a foreign file by a library in a child process: bounded time and memory, and no crash of this process."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.foundation.children import end_with_parent
from drivetwin.foundation.scratch import scratch

SECONDS, SECONDS_A_MEGABYTE = 20, 10
"""Processor time that a file may take; a sound one takes a tenth."""

MEMORY, MEMORY_A_BYTE = 2 << 30, 40
"""Address space [bytes] that a file may take; libraries map one GiB before they read anything."""

_CHILD = Path(__file__).with_name("child.py")


class UnreadableError(Exception):
    """Why the file cannot be read, as a clause."""


def read_in_child(kind: str, file: Path) -> dict[str, np.ndarray[Any, Any]]:
    """The arrays that reader `kind` of `child.py` finds in `file`, by name. Raises UnreadableError, and OSError of the file."""
    size = file.stat().st_size
    seconds = SECONDS + SECONDS_A_MEGABYTE * size // 1_000_000
    limits = [str(seconds), str(MEMORY + MEMORY_A_BYTE * size)]
    with file.open("rb"), scratch() as out:
        done = subprocess.run(
            [sys.executable, "-P", str(_CHILD), kind, str(file.absolute()), str(out), *limits],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=partial(end_with_parent, os.getpid()),  # one call into C, no lock
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            check=False,
        )
        why = Path(out, "error.txt")
        if why.exists():
            raise UnreadableError(why.read_text(encoding="utf-8"))
        if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            raise UnreadableError(f"reading it does not end within {seconds} s")
        if done.returncode != 0:
            raise UnreadableError("it crashes the library that reads it")
        names = json.loads(Path(out, "names.json").read_text(encoding="utf-8"))
        with np.load(Path(out, "arrays.npz"), allow_pickle=False) as arrays:
            return {name: arrays[str(number)] for number, name in enumerate(names)}
