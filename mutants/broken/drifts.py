"""Moves by differences whose rounding errors add up, by a tenth of a milliradian per move."""

from __future__ import annotations

from itertools import count

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("11_soak.to_and_fro", "repeats")


def break_controller() -> None:
    travel, moves = Session.travel, count(1)

    def broken(self: Session, targets: dict[str, float]) -> None:
        drift = 1e-4 * next(moves)
        travel(self, {name: at + drift if name == "rotate" else at for name, at in targets.items()})

    replace(Session, "travel", broken)
