"""What a patch keeps: what closes the gap on motion that was not fitted, and leaves no axis with a larger one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.propose.placing import in_order
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.report.prediction import Patch, contributions, gap_rms, predict, without_level
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.refit import Refitted, alone, masses, refitted_as_read
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import DriveEffect, PlacedEffect
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]


def worth_a_name(
    ready: Prepared, values: Refitted, drives: Sequence[PlacedEffect], least_share: float
) -> tuple[Refitted, Patch]:
    """The patch of a set and effects of the drives less what is not worth a name, and the values of what is left.

    First as it stands, see `worth_as_it_stands`; then also without each effect that the others, fitted again, can do without:
    no axis then keeps more of its gap on motion that was not fitted than an effect must take, all that has left together.
    Effects that make up for each other's errors look indispensable until then.
    """
    patch = worth_as_it_stands(ready, Patch(in_order([*values.effects, *drives]), values.heavier), least_share)
    lowest = np.full(len(ready.simulation.axes), np.inf)
    while True:
        less, lowest = _without_needless(ready, values, patch, lowest, least_share)
        if less is None:
            return values, patch
        values = less
        ahead = [*values.effects, *(one for one in patch.effects if isinstance(one.effect, DriveEffect))]
        patch = worth_as_it_stands(ready, Patch(in_order(ahead), values.heavier), least_share)


def _without_needless(
    ready: Prepared, values: Refitted, patch: Patch, lowest: Array, least_share: float
) -> tuple[Refitted | None, Array]:
    """The values of a patch without the effect that unseen motion needs least, the others fitted again; None where it needs
    each. One that this motion hardly asks for is not judged by it. `lowest` (k,): share of each axis's gap that any patch has
    left there, which is also given back.
    """
    own = [one for one in patch.effects if not isinstance(one.effect, DriveEffect)]
    bodies, unseen = frozenset(patch.heavier or ()), _left_of(ready, ready.checks)
    vetoed = len(own) < len(values.effects) or bodies != frozenset(values.heavier)
    state = alone(values.state, own, bodies) if vetoed else values.state
    if state is None:
        return None, lowest
    whole = Patch(in_order(state.effects) if vetoed else tuple(own), masses(state, bodies))
    lowest = np.minimum(lowest, unseen(whole))
    seldom = _seldom_asked_for(ready, whole)
    asked = [one for one in whole.effects if one not in seldom]

    def without(one: PlacedEffect) -> State | None:
        return alone(state, [each for each in whole.effects if each is not one], bodies)

    able = []
    for one, rest in zip(asked, side_by_side(without, asked), strict=True):
        if rest is None:
            continue
        more = unseen(Patch(in_order(rest.effects), masses(rest, bodies))) - lowest
        if np.max(more) <= min(state.bench.least(one), least_share):
            able.append((float(np.sum(more)), rest))
    best = min(able, key=lambda each: each[0], default=(0.0, None))[1]
    if best is None:
        return None, lowest
    return refitted_as_read(settled_on(coloured(best, ())).read(best.late), bodies), lowest


def worth_as_it_stands(ready: Prepared, patch: Patch, least_share: float) -> Patch:
    """Without effects and bodies that close less than a share of the gap on motion that was not fitted, the worst first, each
    alone, two of an axis that undo each other, or all; and without those by which an axis has a gap that is larger by such a
    share: none pays for another.

    An effect that this motion asks for much less than the fitted one must close that share there, and do no harm here. Those of
    the drive are no matter of the motion, and the torque that they do not give hides no other.
    """
    drives = tuple(one for one in patch.effects if isinstance(one.effect, DriveEffect))
    patch = replace(patch, effects=tuple(one for one in patch.effects if not isinstance(one.effect, DriveEffect)))
    unseen, fitted = _left_of(ready, ready.checks), _left_of(ready, ready.runs)
    seldom, before = _seldom_asked_for(ready, patch), unseen(Patch())
    while patch.effects or patch.heavier:
        rests: list[tuple[PlacedEffect | None, Patch]] = [
            (one, replace(patch, effects=tuple(each for each in patch.effects if each is not one))) for one in patch.effects
        ]
        rests += [(None, replace(patch, heavier=None))] if patch.heavier else []
        whole, without = unseen(patch), [unseen(rest) for _, rest in rests]
        losses = [float(np.sum(left) - np.sum(whole)) for left in without]
        for k, (one, rest) in enumerate(rests):
            if one in seldom and losses[k] >= 0.0:
                losses[k] = float(np.sum(fitted(rest)) - np.sum(fitted(patch)))
        worst = int(np.argmin(losses))
        together = least_share if any(one not in seldom for one in patch.effects) else 0.0
        if losses[worst] > least_share and np.sum(before) - np.sum(whole) >= together:
            harmed = int(np.argmax(whole - before))
            worst = int(np.argmin([left[harmed] for left in without]))
            if whole[harmed] - before[harmed] <= least_share or without[worst][harmed] >= whole[harmed]:
                less = _without_two(patch, seldom, unseen, float(np.sum(whole)) + least_share)
                if less is None:
                    break
                patch = less
                continue
        patch = rests[worst][1]
    return replace(patch, effects=in_order([*patch.effects, *drives]))


def _without_two(patch: Patch, seldom: Sequence[PlacedEffect], unseen: Callable[[Patch], Array], most: float) -> Patch | None:
    """Without the two effects of an axis without which least is left, if that is at most as much; None where it is more."""
    able = [one for one in patch.effects if one not in seldom]
    pairs = [(one, other) for k, one in enumerate(able) for other in able[:k] if one.axis == other.axis]
    rests = [replace(patch, effects=tuple(each for each in patch.effects if each not in pair)) for pair in pairs]
    left = [float(np.sum(unseen(rest))) for rest in rests]
    return rests[int(np.argmin(left))] if left and min(left) <= most else None


def _left_of(ready: Prepared, runs: Sequence[Run]) -> Callable[[Patch], Array]:
    """From a patch to the energy that it leaves of each axis's gap on some motion (k,); infinite for no mechanism."""
    as_it_stands = [predict(ready.simulation, run, Patch()) for run in runs]
    sizes = {axis: max(gap_rms(as_it_stands, axis), 1e-300) for axis in ready.simulation.axes}

    def left(patch: Patch) -> Array:
        try:
            told = [predict(ready.simulation, run, patch) for run in runs]
        except UserError:
            return np.full(len(sizes), np.inf)
        return np.array([(gap_rms(told, axis, "after") / size) ** 2 for axis, size in sizes.items()])

    return left


def _seldom_asked_for(ready: Prepared, patch: Patch) -> list[PlacedEffect]:
    """Effects whose torque on the motion that was not fitted is less than half of that on the fitted one, rms."""
    fitted, unseen = _torques(ready, ready.runs, patch), _torques(ready, ready.checks, patch)
    return [one for one, before, after in zip(patch.effects, fitted, unseen, strict=True) if after < 0.5 * before]


def _torques(ready: Prepared, runs: Sequence[Run], patch: Patch) -> list[float]:
    """Torque of each effect on its own axis where it counts, rms [N·m or N]."""
    parts = [contributions(ready.simulation, run, patch) for run in runs]
    found = []
    for number, one in enumerate(patch.effects):
        own = [run.axes[one.axis] for run in runs]
        rows = [without_level(axis, part[number][one.axis])[axis.used] for part, axis in zip(parts, own, strict=True)]
        squares = np.concatenate(rows) ** 2
        found.append(float(np.sqrt(np.mean(squares))) if squares.size else 0.0)
    return found
