"""Rounds every target to five thousandths of a metre or radian."""

from __future__ import annotations

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("04_moves.small", "final_position")


@instead_of(Session, "travel")
def break_controller(travel: Original, self: Session, targets: dict[str, float]) -> None:
    travel(self, {name: 0.005 * round(at / 0.005) for name, at in targets.items()})
