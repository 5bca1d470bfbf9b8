"""The moves of an axis, as its drive's position demand shows them: from where to where, from when to when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.hil_tests.evidence import Truth

HOMING = 6
"""Mode of operation 6060h (CiA 402-2)."""

PAUSE = 0.02
"""A demand that stands for less than this [s] has not ended a move: it turns."""

STANDS = 1e-9
"""A change of the demand in one cycle [m or rad] that no encoder sees."""


@dataclass(frozen=True)
class Move:
    """Samples `first` to `last` of a truth: the demand leaves its place after `first` and stands again from `last` on."""

    first: int
    last: int

    @property
    def samples(self) -> slice:
        """From the one before it begins to the one where it has ended."""
        return slice(self.first, self.last + 1)


def commanded(truth: Truth, axis: int) -> NDArray[np.bool_]:
    """Where the axis follows positions (n,), homing left out."""
    return np.asarray(truth.enabled[:, axis] & truth.positioning[:, axis] & (truth.mode[:, axis] != HOMING))


def moves(truth: Truth, axis: int) -> list[Move]:
    """All moves of an axis, in their order."""
    if len(truth.time) < 2:
        return []
    follows = commanded(truth, axis)
    both = follows[1:] & follows[:-1]
    changing = np.flatnonzero(both & (np.abs(np.diff(truth.demand[:, axis])) > STANDS))
    if not len(changing):
        return []
    gaps = np.flatnonzero(np.diff(truth.time[changing]) > PAUSE)
    firsts = changing[np.concatenate([[0], gaps + 1])]
    lasts = changing[np.concatenate([gaps, [len(changing) - 1]])] + 1
    return [Move(int(first), int(last)) for first, last in zip(firsts, lasts, strict=True)]


def rests(truth: Truth, axis: int, until_any: bool) -> list[slice]:
    """For each move of an axis, the samples from its end to the next one, as long as the axis is commanded.

    With `until_any` to the next move of any axis: what others do to this one is another matter.
    """
    made = moves(truth, axis)
    axes = range(truth.position.shape[1]) if until_any else (axis,)
    begins = np.array(sorted(move.first for number in axes for move in moves(truth, number)))
    idle = ~commanded(truth, axis)
    found = []
    for move in made:
        later = begins[begins >= move.last]
        end = int(later[0]) + 1 if len(later) else len(truth.time)
        let_go = np.flatnonzero(idle[move.last : end])
        found.append(slice(move.last, move.last + int(let_go[0]) if len(let_go) else end))
    return found
