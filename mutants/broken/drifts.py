"""Moves by differences whose rounding errors add up, by a tenth of a milliradian per move."""

from __future__ import annotations

from itertools import count

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("11_soak.to_and_fro", "repeats")

moves = count(1)


@instead_of(Session, "travel")
def break_controller(travel: Original, self: Session, targets: dict[str, float]) -> None:
    drift = 1e-4 * next(moves)
    travel(self, {name: at + drift if name == "rotate" else at for name, at in targets.items()})
