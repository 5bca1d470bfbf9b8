"""How a task ended, for the program that started it: exit status and controller.json."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path

from drivetwin.foundation.files import write_json

FORMAT = "controller/1"


class Ending(Enum):
    """Ways to end, as controller.json names them."""

    DONE = "done"
    STOPPED = "stopped"
    REFUSED = "refused"

    @property
    def exit_status(self) -> int:
        """Of the program."""
        return {Ending.DONE: 0, Ending.REFUSED: 2, Ending.STOPPED: 3}[self]


@dataclass(frozen=True)
class Outcome:
    """`reason` is empty where the task is done; `node` and `emcy` name the drive that was the cause, and its error code.

    `cycle` [s] is the one that ran, with `cycle_reason` where it is not the one that was asked for; `missed` PDOs were borne,
    and after `recoveries` troubles the task went on.
    """

    ending: Ending
    reason: str = ""
    node: int | None = None
    emcy: int | None = None
    cycle: float | None = None
    cycle_reason: str = ""
    missed: int = 0
    recoveries: int = 0

    def write(self, directory: Path) -> None:
        """Write controller.json."""
        told = asdict(self)
        ending = told.pop("ending")
        write_json(directory / "controller.json", {"format": FORMAT, "outcome": ending.value, **told})
