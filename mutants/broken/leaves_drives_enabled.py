"""Ends when its task is done, with the drives as they are."""

from __future__ import annotations

from drivetwin.controller import stop
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("02_enable.enable", "disabled_at_end")


@instead_of(stop, "disable")
def break_controller(_original: Original, *_arguments: object) -> None:
    """The drives stay enabled."""
