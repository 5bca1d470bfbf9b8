"""Stops permanently after a fault, although the task tells it to continue."""

from __future__ import annotations

from dataclasses import replace as changed
from pathlib import Path

import drivetwin.controller.__main__ as program
from drivetwin.controller.tasks.file import Order, read_order
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("10_recovery.fault_reset", "outcome")


@instead_of(program, "read_order")
def break_controller(_original: Original, path: Path) -> Order:
    return changed(read_order(path), resume=False)
