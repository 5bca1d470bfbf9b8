"""Turns rotate in the wrong direction."""

from __future__ import annotations

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("04_moves.single", "final_position")


def break_controller() -> None:
    travel = Session.travel

    def broken(self: Session, targets: dict[str, float]) -> None:
        travel(self, {name: -at if name == "rotate" else at for name, at in targets.items()})

    replace(Session, "travel", broken)
