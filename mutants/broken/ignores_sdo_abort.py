"""Ignores what a drive refuses, and reads nothing back."""

from __future__ import annotations

from contextlib import suppress

from drivetwin.controller.drive_node import DriveNode
from drivetwin.foundation.errors import UserError
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("01_boot.sdo_refused", "no_ignored_abort")


@instead_of(DriveNode, "write")
def break_controller(write: Original, self: DriveNode, value: float, index: int, subindex: int = 0) -> None:
    with suppress(UserError):
        write(self, value, index, subindex)
