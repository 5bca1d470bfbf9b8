"""What a report left open on an axis, and which motions settle it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.short_moves import ShortMoves
from drivetwin.diagnosis.excitation.slow_strokes import SlowStrokes
from drivetwin.diagnosis.excitation.small_reversals import SmallReversals
from drivetwin.diagnosis.excitation.speed_levels import SpeedLevels
from drivetwin.diagnosis.excitation.standstills import Standstills
from drivetwin.diagnosis.excitation.sweep import Sweep
from drivetwin.diagnosis.excitation.warm_up import WarmUp
from drivetwin.diagnosis.excitation.whole_travel import WholeTravel
from drivetwin.diagnosis.prepare.testable import WHY, NotTestable
from drivetwin.diagnosis.report.result import UNKNOWN
from drivetwin.diagnosis.report.schema import CausePart, GapReport
from drivetwin.emulator.effects import Effect, Need, library
from drivetwin.foundation.errors import UserError

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

LIKELY = 0.05
"""Probability from which a cause is worth a motion; as surely as this one is not there, a cause is settled."""


MOTION_HELPS = frozenset(
    {Need.BOTH_DIRECTIONS, Need.TWO_SPEEDS, Need.REVERSALS, Need.ACCELERATION, Need.TIME, Need.MOTOR_ANGLE}
)
"""What a recording may lack that another motion gives it."""


@dataclass(frozen=True)
class Question:
    """Effects on one axis that recordings left open, most weight first, and the words of the report to it."""

    axis: str
    effects: tuple[str, ...]
    tell_apart_by: str


def open_question(report: GapReport, axis: str) -> Question:
    """What is open on an axis: its likely causes, or where no effect of the library is one, what could not be tested.

    A cause is settled that is distinguished from all others and has a probability of 95 % or more.
    Raises UserError where the report has no such axis, or nothing is open about it that a motion settles.
    """
    if axis not in report.axes:
        raise UserError(f"the report has no axis {axis!r}; it has {', '.join(report.axes)}")
    causes = [one for one in report.causes if one.axis == axis and one.effect != UNKNOWN and one.probability >= LIKELY]
    return _among(causes, axis) if causes else _untested(report.axes[axis].not_testable, axis)


def _among(causes: Sequence[CausePart], axis: str) -> Question:
    """These causes, each with those that it is not distinguished from."""
    if all(one.probability >= 1.0 - LIKELY and not one.indistinguishable_from for one in causes):
        raise UserError(f"the report leaves nothing open on axis {axis!r}: each of its causes stands alone")
    effects = [effect for one in causes for effect in (one.effect, *one.indistinguishable_from)]
    words = dict.fromkeys(one.tell_apart_by for one in causes if one.tell_apart_by)
    return Question(axis, tuple(dict.fromkeys(effects)), "; ".join(words))


def _untested(entries: Sequence[NotTestable], axis: str) -> Question:
    """Effects that another motion would make testable."""
    motions = {WHY[need] for need in MOTION_HELPS}
    asked = [one for one in entries if (one.reason, one.needed) in motions]
    if not asked:
        rest = f"; it could not test {entries[0].effect}, which needs {entries[0].needed}" if entries else ""
        raise UserError(f"the report leaves nothing open on axis {axis!r} that a motion settles{rest}")
    needed = dict.fromkeys(one.needed for one in asked)
    return Question(axis, tuple(dict.fromkeys(one.effect for one in asked)), "; ".join(needed))


def chosen(effects: Sequence[str]) -> tuple[Excitation, ...]:
    """Every motion that distinguishes one of the effects from others, in the order in which they run.

    Raises UserError for an effect that the library has not, and for effects that no motion distinguishes.
    """
    shown_by = {motion for kind in _kinds(effects) for motion in kind.shown_by}
    found = tuple(one for one in EXCITATIONS if one.name in shown_by)
    if not found:
        raise UserError(f"no motion of this library distinguishes {', '.join(effects)}")
    return found


def by_poses(effects: Sequence[str]) -> bool:
    """Whether one of the effects shows by how it changes with the places of the other axes."""
    return any(kind.by_poses for kind in _kinds(effects))


def _kinds(effects: Sequence[str]) -> list[type[Effect]]:
    known = library()
    if unknown := [name for name in effects if name not in known]:
        raise UserError(f"the report names effect {unknown[0]!r}, which the library has not; give its --effects-from FILE.py")
    return [known[name] for name in effects]
