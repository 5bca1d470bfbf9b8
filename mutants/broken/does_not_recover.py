"""Stops for good after a fault, although it was told to go on."""

from __future__ import annotations

from dataclasses import replace as changed
from pathlib import Path

import controller.__main__ as program
from controller.tasks.file import Order, read_order
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("10_recovery.fault_reset", "outcome")


def break_controller() -> None:
    def broken(path: Path) -> Order:
        return changed(read_order(path), resume=False)

    replace(program, "read_order", broken)
