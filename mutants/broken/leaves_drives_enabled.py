"""Ends when its task is done, with the drives as they are."""

from __future__ import annotations

from drivetwin.controller import stop
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("02_enable.enable", "disabled_at_end")


def break_controller() -> None:
    def broken(*_arguments: object) -> None:
        """The drives stay enabled."""

    replace(stop, "disable", broken)
