"""A process of a pool ends with the one that started it, however early that is killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
from processes import PATIENCE

SCRIPT = """
import os, sys
from concurrent.futures import ProcessPoolExecutor
from drivetwin.foundation.children import tied_processes

if __name__ == "__main__":
    import begins_for_ever
    os.environ["BEGINS_FOR_EVER"] = sys.argv[1]
    with ProcessPoolExecutor(1, tied_processes(), begins_for_ever.begin) as pool:
        pool.submit(os.getpid).result()
"""

MODULE = """
import os, pathlib, time

def begin():
    pass

if "BEGINS_FOR_EVER" in os.environ:
    pathlib.Path(os.environ["BEGINS_FOR_EVER"]).write_text(str(os.getpid()))
    time.sleep(600)
"""


def test_a_process_that_still_imports_what_it_is_to_do_ends_with_its_parent(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT, encoding="ascii")
    (tmp_path / "begins_for_ever.py").write_text(MODULE, encoding="ascii")
    told = tmp_path / "pid"
    found = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen([sys.executable, tmp_path / "script.py", told], env=found)
    try:
        until = time.monotonic() + PATIENCE
        while not (told.exists() and told.read_text(encoding="ascii")):
            assert parent.poll() is None
            assert time.monotonic() < until
            time.sleep(0.05)
        child = psutil.Process(int(told.read_text(encoding="ascii")))
    finally:
        parent.kill()
        parent.wait()
    _, living = psutil.wait_procs([child], timeout=PATIENCE)
    for one in living:
        one.kill()
    assert living == []
