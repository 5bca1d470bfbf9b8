"""Whoever is killed leaves nothing for good: its children end with it, its temporary folders go at the next start."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from drivetwin.foundation.files import new_directory
from drivetwin.foundation.scratch import scratch

IN_SCRATCH = """
import sys, time
from drivetwin.foundation.scratch import scratch
with scratch() as folder:
    (folder / "big").write_text("truth")
    print(folder, flush=True)
    time.sleep(600)
"""

WRITES = """
import sys, time
from pathlib import Path
from drivetwin.foundation.files import new_directory
with new_directory(Path(sys.argv[1])) as folder:
    (folder / "half").write_text("half")
    print(folder, flush=True)
    time.sleep(600)
"""

HAS_A_CHILD = """
import os, subprocess, sys, time
from functools import partial
from drivetwin.foundation.children import end_with_parent
sleeps = [sys.executable, "-c", "import time; time.sleep(600)"]
child = subprocess.Popen(sleeps, preexec_fn=partial(end_with_parent, os.getpid()))
print(child.pid, flush=True)
time.sleep(600)
"""


@pytest.fixture(autouse=True)
def own_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


def started(program: str, *words: str) -> tuple[subprocess.Popen[str], str]:
    """A process, and the line that it said."""
    process = subprocess.Popen([sys.executable, "-c", program, *words], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, process.stdout.readline().strip()


def killed(process: subprocess.Popen[str]) -> None:
    """End it without a chance; returns once nobody holds its end of the pipe, children among them."""
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60.0)


def test_the_scratch_of_who_was_killed_goes_at_the_next_start_and_that_of_who_lives_stays(tmp_path: Path) -> None:
    dead, left = started(IN_SCRATCH)
    living, used = started(IN_SCRATCH)
    killed(dead)
    assert Path(left, "big").exists()
    try:
        with scratch() as mine:
            assert sorted(tmp_path.iterdir()) == sorted([Path(used), mine])
            assert Path(used, "big").exists()
    finally:
        killed(living)


def test_scratch_leaves_nothing(tmp_path: Path) -> None:
    with scratch() as folder:
        (folder / "file").touch()
    assert list(tmp_path.iterdir()) == []


def test_what_was_half_written_goes_when_it_is_written_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    other, foreign = started(WRITES, str(tmp_path / "other"))
    dead, left = started(WRITES, str(out))
    killed(dead)
    try:
        assert Path(left, "half").exists()
        with new_directory(out) as folder:
            (folder / "whole").touch()
        assert sorted(tmp_path.iterdir()) == [Path(foreign), out]
    finally:
        killed(other)


def test_a_child_ends_with_a_parent_that_is_killed() -> None:
    process, child = started(HAS_A_CHILD)
    assert Path("/proc", child).exists()
    killed(process)
