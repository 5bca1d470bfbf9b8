"""The gap of one axis divided up, and what of it each effect takes, those of other axes too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.propose.placing import alike
from drivetwin.diagnosis.report.gaps import Gaps
from drivetwin.diagnosis.report.prediction import attributed, contributions
from drivetwin.diagnosis.report.result import Share
from drivetwin.diagnosis.report.shares import shares
from drivetwin.emulator.effects import PlacedEffect

Array = NDArray[np.float64]
Part = list[Array]
"""A torque over the samples in use, (n,) of each recording."""

OTHER_AXES, MASSES = "other_axes", "masses"


@dataclass(frozen=True)
class Divided:
    """Shares of an axis's gap: its own effects, all that acts on it from elsewhere as one, the unknown, noise; and of each
    effect that acts on it what it takes.
    """

    shares: tuple[Share, ...]
    taken: Sequence[tuple[PlacedEffect, float]]

    def share_of(self, one: PlacedEffect) -> float:
        """What goes to an effect; 0 for one that does not act here."""
        return next((share for other, share in self.taken if alike(one, other)), 0.0)

    def of(self, name: str) -> float:
        """What goes to the unknown, say; 0 where nothing does."""
        return next((share.share for share in self.shares if share.of == name), 0.0)


def divided(ready: Prepared, gaps: Gaps, axis: str, seed: int) -> Divided:
    """What the effects of an axis take as they stand, those of others and heavier bodies by their torque on it."""
    seen = [each.axes[axis] for each in gaps.unseen]
    own = tuple(one for one in gaps.patch.effects if one.axis == axis)
    gap = [(each.measured - each.before)[each.used] for each in seen]
    torque = [
        [attributed(ready.simulation, run, own, k, axis)[each.used] for run, each in zip(ready.checks, seen, strict=True)]
        for k in range(len(own))
    ]
    others = _others(ready, gaps, axis)
    names = [one.effect.name for one in own]
    periods, noise = [run.period for run in ready.checks], gaps.noise[axis].rms
    if not others:
        found = shares(gap, torque, names, periods, noise, seed)
        return Divided(found, list(zip(own, (each.share for each in found), strict=False)))
    named = OTHER_AXES if len(ready.simulation.axes) > 1 else MASSES
    together = [np.asarray(sum(parts)) for parts in zip(*(part for _, part in others), strict=True)]
    found = shares(gap, [*torque, together], [*names, named], periods, noise, seed)
    each_alone = shares(together, [part for _, part in others], [named] * len(others), periods, 0.0, seed)
    elsewhere = found[len(own)].share if found else 0.0
    told = [
        (one, elsewhere * part.share) for (one, _), part in zip(others, each_alone, strict=False) if one is not None
    ]
    return Divided(found, [*zip(own, (each.share for each in found), strict=False), *told])


def _others(ready: Prepared, gaps: Gaps, axis: str) -> list[tuple[PlacedEffect | None, Part]]:
    """What acts on an axis and is not its own, with its torque there; None for a heavier body."""
    parts = [contributions(ready.simulation, run, gaps.patch) for run in ready.checks]
    used = [each.axes[axis].used for each in gaps.unseen]
    effects: Sequence[PlacedEffect | None] = (*gaps.patch.effects, *(None for _ in gaps.patch.heavier or {}))
    found: list[tuple[PlacedEffect | None, Part]] = []
    for number, one in enumerate(effects):
        if one is not None and one.axis == axis:
            continue
        here = [part[number].get(axis, np.zeros(len(rows)))[rows] for part, rows in zip(parts, used, strict=True)]
        if any(rows.any() for rows in here):
            found.append((one, here))
    return found
