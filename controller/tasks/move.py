"""move: one axis at a time to absolute positions."""

from __future__ import annotations

from functools import partial

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, NonNegativeFloat, PositiveInt

from drivetwin.controller.machine import Machine
from drivetwin.controller.session import Session
from drivetwin.controller.tasks.base import Task, Work, check_target


class SingleMove(BaseModel):
    """One axis `to` a position [m or rad]."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    axis: str
    to: FiniteFloat


class Move(Task):
    """`moves` in their order, `repeat` times, with `dwell` [s] of standing after each."""

    moves: tuple[SingleMove, ...] = Field(min_length=1)
    repeat: PositiveInt = 1
    dwell: NonNegativeFloat = 0.3

    def check(self, machine: Machine) -> None:
        for move in self.moves:
            check_target(machine, move.axis, move.to)

    def run(self, work: Work) -> None:
        for _ in range(self.repeat):
            for move in self.moves:
                work.do(partial(self._move, work.session, move))

    def _move(self, session: Session, move: SingleMove) -> None:
        session.travel({move.axis: move.to})
        session.wait(self.dwell)
