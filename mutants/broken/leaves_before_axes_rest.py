"""Goes once no drive has voltage any more, while an axis that brakes still takes others along."""

from __future__ import annotations

from collections.abc import Sequence

from controller import stop
from controller.cycle import Cycle
from controller.drive_node import DriveNode
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.setpoints_late", "disabled_at_end")


def break_controller() -> None:
    def broken(_cycle: Cycle, _drives: Sequence[DriveNode]) -> list[DriveNode]:
        return []

    replace(stop, "_still_moving", broken)
