"""Works for two thirds of the time that the task sets."""

from __future__ import annotations

from drivetwin.controller.tasks.base import Work
from drivetwin.controller.tasks.soak import Soak
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("11_soak.to_and_fro", "keeps_moving")


@instead_of(Soak, "run")
def break_controller(run: Original, self: Soak, work: Work) -> None:
    run(self.model_copy(update={"seconds": self.seconds * 2.0 / 3.0}), work)
