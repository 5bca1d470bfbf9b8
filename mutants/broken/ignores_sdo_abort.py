"""Takes no notice of what a drive refuses, and reads nothing back."""

from __future__ import annotations

from contextlib import suppress

from controller.drive_node import DriveNode
from drivetwin.errors import UserError
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("01_boot.sdo_refused", "no_ignored_abort")


def break_controller() -> None:
    write = DriveNode.write

    def broken(self: DriveNode, value: float, index: int, subindex: int = 0) -> None:
        with suppress(UserError):
            write(self, value, index, subindex)

    replace(DriveNode, "write", broken)
