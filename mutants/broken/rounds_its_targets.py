"""Rounds every target to five thousandths of a metre or radian."""

from __future__ import annotations

from controller.session import Session
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("04_moves.small", "final_position")


def break_controller() -> None:
    travel = Session.travel

    def broken(self: Session, targets: dict[str, float]) -> None:
        travel(self, {name: 0.005 * round(at / 0.005) for name, at in targets.items()})

    replace(Session, "travel", broken)
