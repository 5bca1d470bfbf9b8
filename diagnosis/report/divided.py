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
        """What goes to an effect, or else to one like it, settled since; 0 for one that does not act here."""
        alike_ones = [share for other, share in self.taken if alike(one, other)]
        return next((share for other, share in self.taken if other is one), next(iter(alike_ones), 0.0))

    def of(self, name: str) -> float:
        """What goes to the unknown, say; 0 where nothing does."""
        return next((share.share for share in self.shares if share.of == name), 0.0)


def divided(ready: Prepared, gaps: Gaps, axis: str, seed: int) -> Divided:
    """What each effect that acts on an axis takes: of its own by `attributed`, of others and heavier bodies by their torque."""
    seen = [each.axes[axis] for each in gaps.unseen]
    own = tuple(one for one in gaps.patch.effects if one.axis == axis)
    gap = [(each.measured - each.before)[each.used] for each in seen]
    torque = [
        [attributed(ready.simulation, run, own, k, axis)[each.used] for run, each in zip(ready.checks, seen, strict=True)]
        for k in range(len(own))
    ]
    others = _others(ready, gaps, axis)
    parts = [*torque, *(part for _, part in others)]
    name = OTHER_AXES if len(ready.simulation.axes) > 1 else MASSES
    names = [*(one.effect.name for one in own), *(name for _ in others)]
    found = shares(gap, parts, names, [run.period for run in ready.checks], gaps.noise[axis].rms, seed)
    acting = [*own, *(one for one, _ in others)]
    taken = [(one, each.share) for one, each in zip(acting, found, strict=False) if one is not None]
    first, last = found[: len(own)], found[len(parts) :]
    elsewhere = (_together(name, found[len(own) : len(parts)]),) if found and others else ()
    return Divided((*first, *elsewhere, *last), taken)


def _together(name: str, several: Sequence[Share]) -> Share:
    """Several shares as one, whose interval is the sum of theirs: no narrower than it is."""
    low, high = (sum(each.ci90[end] for each in several) for end in (0, 1))
    return Share(name, sum(each.share for each in several), (low, min(high, 1.0)))


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
