"""Whether MuJoCo compiles a file: asked in a separate process, because a file may hang or crash MuJoCo."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import lru_cache, partial
from pathlib import Path

from drivetwin.foundation.children import end_with_parent
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.scratch import scratch

SECONDS = 25.0
"""That compilation may take at most [s]."""
PROGRAM = Path(__file__).with_name("mjcf_fault.py")


def check_compiles(path: Path) -> None:
    """Raises UserError where MuJoCo does not make a model with finite inertia of an MJCF file, or not within `SECONDS`."""
    if not path.is_file():
        raise UserError(f"no model at {path}: give the path of a MuJoCo XML file")
    if wrong := _wrong_with(path.resolve(), path.stat().st_mtime_ns):
        raise UserError(f"{path} {wrong}")


@lru_cache(maxsize=32)
def _wrong_with(path: Path, _changed: int) -> str:
    """What is wrong with a file, one line; empty where nothing is. Asked once for each state of the file."""
    with scratch() as folder:  # MuJoCo writes its warnings to where it runs
        command = [sys.executable, "-P", str(PROGRAM), str(path)]
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                capture_output=True,
                text=True,
                timeout=SECONDS,
                check=False,
                preexec_fn=partial(end_with_parent, os.getpid()),  # one call into C, no lock
            )
        except subprocess.TimeoutExpired:
            return f"takes MuJoCo more than {SECONDS:g} s to compile: leave out what moves no axis, or make its meshes coarser"
    if done.returncode:
        last = " ".join(done.stderr.split("\n")[-2:]).strip()
        return f"ends MuJoCo ({last or f'exit status {done.returncode}'}): correct it until MuJoCo's own tools compile it"
    return " ".join(done.stdout.split())
