"""The base of every task: parameters that are checked before anything moves, and what is done with a configured machine."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from drivetwin.controller.machine import Machine
from drivetwin.controller.recovery import GivenUpError, recover
from drivetwin.controller.session import Session
from drivetwin.controller.trouble import TroubleError
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

MOST_RECOVERIES = 5
"""Of a task; a machine that has more of them needs somebody to look at it."""


@dataclass
class Work:
    """A machine that is brought up and supervised, no axis enabled, where results go, and whether to go on after trouble."""

    session: Session
    out: Path
    seed: int
    resume: bool
    recoveries: int = 0

    def do(self, step: Callable[[], None]) -> None:
        """Do a step with axes that are homed and stream; after trouble that can be cleared, do it again from where they stand.

        Raises TroubleError where the task is not to be resumed, or the trouble stays.
        """
        while True:
            try:
                self.session.ready()
                step()
            except TroubleError as trouble:
                self._recover(trouble)
            else:
                return

    def _recover(self, trouble: TroubleError) -> None:
        """Raise `trouble` where nothing can be done, else end it."""
        while self.resume and self.recoveries < MOST_RECOVERIES:
            self.recoveries += 1
            logger.warning("%s; recovering", trouble)
            try:
                recover(self.session)
            except GivenUpError:
                raise
            except TroubleError as further:
                trouble = further
            else:
                return
        raise trouble


class Task(BaseModel, ABC):
    """A task with its parameters, as task.json gives them."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def check(self, machine: Machine) -> None:
        """Raise UserError for what this machine cannot do."""
        return

    @abstractmethod
    def run(self, work: Work) -> None:
        """Do it; afterwards whoever called disables the axes. Raises UserError for what keeps it from being done."""


def check_target(machine: Machine, axis: str, position: float) -> None:
    """Raise UserError where a machine has no such axis, or it may not go there [m or rad]."""
    machine.check_axes([axis])
    low, high = machine.axes[axis].travel
    if not low <= position <= high:
        raise UserError(f"{axis} is to go to {position:g}, and its travel is {low:g} .. {high:g}: choose a position within it")
