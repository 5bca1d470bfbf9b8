"""Turns rotate in the wrong direction."""

from __future__ import annotations

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("04_moves.single", "final_position")


@instead_of(Session, "travel")
def break_controller(travel: Original, self: Session, targets: dict[str, float]) -> None:
    travel(self, {name: -at if name == "rotate" else at for name, at in targets.items()})
