"""Starts a process of its own and does not end it."""

from __future__ import annotations

import subprocess
import sys

from drivetwin.mutants.base import CaughtBy

CAUGHT_BY = CaughtBy("01_boot.configured", "leaves nothing")


def break_controller() -> None:
    subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], stdin=subprocess.DEVNULL)
