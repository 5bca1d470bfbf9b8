"""Stops, and names another drive than the one that was the cause."""

from __future__ import annotations

from dataclasses import replace as changed

import controller.__main__ as program
from controller.outcome import Outcome
from controller.perform import Place, perform
from controller.tasks.file import Order
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.limit_switch", "names_fault")


def break_controller() -> None:
    def broken(order: Order, place: Place) -> Outcome:
        return changed(perform(order, place), node=3)

    replace(program, "perform", broken)
