"""What a report claims to be indistinguishable from a true effect, where it is right only if that is so."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.blind.case import Case
from drivetwin.blind.told import Told


@dataclass(frozen=True)
class Claim:
    """An answer that is no cause itself, and names a true effect of its axis among what it cannot be distinguished from.

    Where a small nuisance has that name on the axis, what the answer says of the gap is a cause's.
    """

    effect: str
    axis: str
    truth: str


def claims(case: Case, report: Told | None) -> tuple[Claim, ...]:
    """All claims of a report, in its order. What is selected itself needs no other name."""
    if report is None:
        return ()
    selected = {(one.effect, one.axis) for one in report.selected}
    causes = {(one.effect, one.axis) for one in case.causes}
    named = selected | {(one.effect, one.axis) for one in report.causes[:1]}
    open_ones = [one for one in sorted(case.there) if one not in named]
    return tuple(
        Claim(told.effect, told.axis, truth)
        for told in report.causes
        if told.axis is not None and (told.effect, told.axis) not in causes
        for truth, axis in open_ones
        if axis == told.axis and truth in told.indistinguishable_from
        if (told.effect, told.axis) not in case.there or (truth, axis) in causes
    )
