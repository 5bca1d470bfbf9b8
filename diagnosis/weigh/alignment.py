"""The moment at which each axis's torque was read, sought exactly: where friction turns round, torque is not linear in it.

What the timing parameter of an axis says of it is a straight line, which a delay of half a millisecond leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.weigh.state import LATEST, State
from drivetwin.emulator.effects.delay import Delay

Array = NDArray[np.float64]

FIRST, LEAST = 1e-3, 6e-5
"""Steps [s] with which the best moment is sought: the first, and the one below which the straight line holds."""
GAIN = 0.5
"""Nats that a step must bring."""
USUAL = 0.003
"""By which a torque is usually late at most [s]: an average over some milliseconds, a current filter of 50 Hz."""


def aligned(state: State, beside: Sequence[Column] = (), axis: str | None = None) -> State:
    """The set with the torque of each axis, or of one, read as much earlier as the evidence wants, from where it is read now.

    `beside`: further free columns, whitened. A torque that comes early is not read later: that is a position that comes late,
    an effect of the library, beside which no torque is late. Nor is one read so that more is left: a wave that is not in the
    set yet is no delay. Nor that of an axis without a gap: friction that yields where it turns round looks late there, and the
    torque of all other motion would then be early.
    """
    delayed = {one.axis for one in state.effects if isinstance(one.effect, Delay)}
    asked = [one for one in (state.rows.axes if axis is None else (axis,)) if one not in state.bench.without_gap]
    late = {one: 0.0 if one in delayed else _best(state, one, beside) for one in asked}
    if all(each == state.late.get(one, 0.0) for one, each in late.items()):
        return state
    late, most = {**state.late, **late}, state.bench.settings.least_share
    found = state.read(late)
    worse = {one: state.late.get(one, 0.0) for one in asked if found.left[one] > state.left[one] + most}
    return state.read(late | worse) if worse else found


def _best(state: State, axis: str, beside: Sequence[Column]) -> float:
    now = state.late.get(axis, 0.0)
    before = state.bench.target(axis, now)
    return best_moment(lambda late: _evidence(state, axis, beside, before, late), now, GAIN)


def best_moment(worth: Callable[[float], float], now: float, gain: float) -> float:
    """How late [s] a torque is best read, sought from `now` in steps that each must bring so much."""
    best, gained = now, worth(now)
    step = FIRST
    while step >= LEAST:
        tried = [each for each in (0.0, best - step, best + step) if 0.0 <= each <= LATEST]
        found = max(((worth(each), each) for each in tried), default=(gained, best))
        if found[0] > gained + gain:
            gained, best = found
        else:
            step /= 4.0
    return best


def _evidence(state: State, axis: str, beside: Sequence[Column], before: Array, late: float) -> float:
    less = state.system.whiten({axis: before - state.bench.target(axis, late)})
    return state.system.fit(beside, less, state.held()).evidence - _rare(late)


def _rare(late: float) -> float:
    return 0.5 * (late / USUAL) ** 2
