"""The noise about a set of effects: coloured as what is left by the set and by everything that could be asked beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.colour import Colour
from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.weigh.alignment import aligned
from drivetwin.diagnosis.weigh.explained import colours_of
from drivetwin.diagnosis.weigh.proposal import Proposal
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import STEPS, settled_on
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]


def coloured(found: State, proposals: Sequence[Proposal]) -> State:
    """A set, the noise coloured anew, so that an effect that is not in it yet does not pass as noise."""
    return state_of(found.bench, found.effects, _colours(found, _costs(found, proposals)), found.late, found.exact)


def in_its_noise(found: State, stands: State, axis: str | None = None, steps: int = STEPS) -> State:
    """A set, settled some steps in the noise that it leaves itself: so sets compare whose noise was fitted to something else.

    Noise that was fitted to one set's errors makes these likely and another's unlikely. Rows count as in the set that `stands`:
    the evidence of unlike numbers of rows would depend on the unit of torque. `axis`: only effects of one axis move.
    """
    counts = {name: own.colour.counts for name, own in stands.axes.items()}
    return _counted(settled_on(_counted(found, counts), steps, axis), counts)


def _counted(found: State, counts: Mapping[str, Array]) -> State:
    """A set, the noise coloured as what it leaves, each row (N,) of an axis as so many."""
    colours = {axis: replace(colour, counts=counts[axis]) for axis, colour in _colours(found, ()).items()}
    return state_of(found.bench, found.effects, colours, found.late, found.exact)


def read_anew(found: State, proposals: Sequence[Proposal]) -> State:
    """A set, its torque read as late as is best beside everything that could be asked, no row of less weight than another.

    Torque that is late errs most where friction turns round; noise with long tails that has learned that hides it.
    """
    costs = _costs(found, proposals)
    plain = {axis: colour.normal for axis, colour in _colours(found, costs).items()}
    state = state_of(found.bench, found.effects, plain, found.late, found.exact)
    return found.read(aligned(state, [state.system.whiten(each) for each in costs]).late)


def _costs(found: State, proposals: Sequence[Proposal]) -> list[Column]:
    """What each proposal costs beside the set; without those that nothing can follow there."""
    costs = []
    for one in proposals:
        try:
            costs.append(found.felt(one.effect.axis, one.effect.effect).added)
        except UserError:
            continue
    return costs


def _colours(found: State, costs: Sequence[Column]) -> Mapping[str, Colour]:
    """Of what least squares leave, the unknown taken off."""
    state = state_of(found.bench, found.effects, found.bench.white, found.late, found.exact)
    columns = [state.system.whiten(each) for each in costs]
    fit = state.system.fit(columns)
    level = {axis: own.colour.level for axis, own in state.system.axes.items()}
    left = state.system.residual(fit, columns)
    noise = {axis: rows - state.system.unknown_of(axis, rows, fit.level[axis]) for axis, rows in left.items()}
    return colours_of(found.bench, {axis: rows * level[axis] for axis, rows in noise.items()})
