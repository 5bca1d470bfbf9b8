"""Overshoots each target slightly, and returns."""

from __future__ import annotations

from drivetwin.controller.motion import positions_now
from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("04_moves.single", "overshoot")


@instead_of(Session, "travel")
def break_controller(travel: Original, self: Session, targets: dict[str, float]) -> None:
    here = dict(zip(self.machine.axes, positions_now(self.drives).tolist(), strict=True))
    travel(self, {name: at + 0.01 * (at - here[name]) for name, at in targets.items()})
    travel(self, targets)
