"""Goes from ready to switch on to operation enabled in one step."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller import motion
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import SWITCHED_ON, DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("02_enable.enable", "state_sequence")


@instead_of(motion, "_await_state")
def break_controller(await_state: Original, cycle: Cycle, drives: Sequence[DriveNode], state: int) -> None:
    if state == SWITCHED_ON:
        return
    await_state(cycle, drives, state)
