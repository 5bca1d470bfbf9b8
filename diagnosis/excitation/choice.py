"""What a report left open on an axis, and which motions settle it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.excitation.base import Excitation
from diagnosis.excitation.short_moves import ShortMoves
from diagnosis.excitation.slow_strokes import SlowStrokes
from diagnosis.excitation.small_reversals import SmallReversals
from diagnosis.excitation.speed_levels import SpeedLevels
from diagnosis.excitation.standstills import Standstills
from diagnosis.excitation.sweep import Sweep
from diagnosis.excitation.warm_up import WarmUp
from diagnosis.excitation.whole_travel import WholeTravel
from diagnosis.gap_report import CausePart, GapReport
from diagnosis.result import NONE, UNKNOWN
from drivetwin.errors import UserError

EXCITATIONS: tuple[Excitation, ...] = (
    WarmUp(),
    SlowStrokes(),
    SpeedLevels(),
    WholeTravel(),
    Standstills(),
    SmallReversals(),
    ShortMoves(),
    Sweep(),
)
"""In the order in which they run: what needs a cold machine first, what shakes it last."""

OTHER_POSES = frozenset({"payload", "coupling", "gravity"})
"""Effects that show by how they change with the places of the other axes."""
LIKELY = 0.05
"""Probability from which an answer beside the first is worth a motion."""


@dataclass(frozen=True)
class Question:
    """Effects on one axis that recordings did not tell apart, most probable first, and the words of the report to it."""

    axis: str
    effects: tuple[str, ...]
    tell_apart_by: str


def open_question(report: GapReport, axis: str) -> Question:
    """The first step's answers on an axis that are left: those called indistinguishable, and those with 5 % or more.

    Raises UserError where the report has no such axis, or nothing is open about it.
    """
    if axis not in report.axes:
        raise UserError(f"the report has no axis {axis!r}; it has {', '.join(report.axes)}")
    for step in sorted({cause.step for cause in report.causes}):
        causes = [one for one in report.causes if one.step == step and one.axis == axis and one.effect not in (UNKNOWN, NONE)]
        effects = _left(causes)
        if len(effects) > 1:
            words = next((one.tell_apart_by for one in causes if one.tell_apart_by), "")
            return Question(axis, effects, words)
    raise UserError(f"the report leaves nothing open on axis {axis!r}: every step has one effect there that stands alone")


def _left(causes: Sequence[CausePart]) -> tuple[str, ...]:
    if not causes:
        return ()
    likely = [one.effect for one in causes if one.probability >= LIKELY]
    return tuple(dict.fromkeys([causes[0].effect, *causes[0].indistinguishable_from, *likely]))


def chosen(effects: Sequence[str]) -> tuple[Excitation, ...]:
    """Every motion that sets one of the effects apart, in the order in which they run.

    Raises UserError for effects that no motion of this library sets apart.
    """
    found = tuple(one for one in EXCITATIONS if one.tells & set(effects))
    if not found:
        raise UserError(f"no motion of this library sets apart {', '.join(effects)}")
    return found
