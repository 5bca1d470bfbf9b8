"""Never joins the bus."""

from __future__ import annotations

from threading import Event

from drivetwin.mutants.base import CaughtBy

CAUGHT_BY = CaughtBy("01_boot.configured", "outcome")


def break_controller() -> None:
    Event().wait()
