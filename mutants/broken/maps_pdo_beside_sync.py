"""Maps set-points to act on arrival instead of all at the same SYNC."""

from __future__ import annotations

from drivetwin.controller import drive_node
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("01_boot.configured", "pdo_mapping")


def break_controller() -> None:
    replace(drive_node, "SYNCHRONOUS", drive_node.EVENT_DRIVEN)
