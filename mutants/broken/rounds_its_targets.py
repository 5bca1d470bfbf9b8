"""Rounds every target to five thousandths of a metre or radian."""

from __future__ import annotations

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("04_moves.small", "final_position")


def break_controller() -> None:
    travel = Session.travel

    def broken(self: Session, targets: dict[str, float]) -> None:
        travel(self, {name: 0.005 * round(at / 0.005) for name, at in targets.items()})

    replace(Session, "travel", broken)
