"""Stops, but names a drive that was not the cause."""

from __future__ import annotations

from dataclasses import replace as changed

import drivetwin.controller.__main__ as program
from drivetwin.controller.outcome import Outcome
from drivetwin.controller.perform import Place, perform
from drivetwin.controller.tasks.file import Order
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.limit_switch", "names_fault")


@instead_of(program, "perform")
def break_controller(_original: Original, order: Order, place: Place) -> Outcome:
    return changed(perform(order, place), node=3)
