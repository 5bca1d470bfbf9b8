"""Resets every fault on its own and continues, whatever the task says."""

from __future__ import annotations

from dataclasses import replace as changed
from pathlib import Path

import drivetwin.controller.__main__ as program
from drivetwin.controller.tasks.file import Order, read_order
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.drive_fault", "stays_disabled")


@instead_of(program, "read_order")
def break_controller(_original: Original, path: Path) -> Order:
    return changed(read_order(path), resume=True)
