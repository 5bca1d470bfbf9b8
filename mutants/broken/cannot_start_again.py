"""Leaves a lock file behind when it is stopped, and refuses to start until somebody removes it."""

from __future__ import annotations

import drivetwin.controller.__main__ as program
from drivetwin.controller.outcome import Ending, Outcome
from drivetwin.controller.perform import Place, perform
from drivetwin.controller.tasks.file import Order
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("10_recovery.power_cycle", "outcome")


@instead_of(program, "perform")
def break_controller(_original: Original, order: Order, place: Place) -> Outcome:
    lock = place.out.parent / "controller.lock"
    if lock.exists():
        return Outcome(Ending.REFUSED, f"{lock.name} is there: does another controller run?")
    lock.touch()
    outcome = perform(order, place)
    if outcome.ending is Ending.DONE:
        lock.unlink()
    return outcome
