"""The gap of one axis divided up, and what of it each effect takes, those of other axes too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.propose.placing import alike
from drivetwin.diagnosis.report.gaps import Gaps
from drivetwin.diagnosis.report.prediction import attributed, contributions, without_level
from drivetwin.diagnosis.report.result import Share
from drivetwin.diagnosis.report.shares import shares
from drivetwin.diagnosis.weigh.bench import NO_TORQUE
from drivetwin.emulator.effects import PlacedEffect

Array = NDArray[np.float64]
Part = list[Array]
"""A torque over the samples in use, (n,) of each recording."""

OTHER_AXES, MASSES = "other_axes", "masses"

Acting = PlacedEffect | int
"""What acts on an axis: an effect, or a body, by number, of another mass."""


@dataclass(frozen=True)
class Divided:
    """Shares of an axis's gap: its own effects, those of other axes as one, corrected masses as one, the unknown, noise; and
    what each that acts on it takes.
    """

    shares: tuple[Share, ...]
    taken: Sequence[tuple[Acting, float]]

    def share_of(self, one: PlacedEffect) -> float:
        """What goes to an effect, or else to one like it, settled since; 0 for one that does not act here."""
        alike_ones = [share for other, share in self.taken if isinstance(other, PlacedEffect) and alike(one, other)]
        return next((share for other, share in self.taken if other is one), next(iter(alike_ones), 0.0))

    def share_of_body(self, body: int) -> float:
        """What goes to the mass of a body, by its number; 0 where it does not act here."""
        return next((share for other, share in self.taken if other == body), 0.0)

    def of(self, name: str) -> float:
        """What goes to the unknown, say; 0 where nothing does."""
        return next((share.share for share in self.shares if share.of == name), 0.0)


def divided(ready: Prepared, gaps: Gaps, axis: str, seed: int) -> Divided:
    """What each effect that acts on an axis takes: of its own by `attributed`, of others and heavier bodies by their torque."""
    seen = [each.axes[axis] for each in gaps.unseen]
    own = tuple(one for one in gaps.patch.effects if one.axis == axis)
    gap = [(each.measured - each.before)[each.used] for each in seen]
    simulation = ready.simulation
    torque = [[_felt(run, axis, attributed(simulation, run, own, k, axis)) for run in ready.checks] for k in range(len(own))]
    others = _others(ready, gaps, axis)
    parts = [*torque, *(part for _, part in others)]
    acting: list[Acting] = [*own, *(one for one, _ in others)]
    names = [*(one.effect.name for one in own), *(MASSES if isinstance(one, int) else OTHER_AXES for one, _ in others)]
    found = shares(gap, parts, names, [run.period for run in ready.checks], gaps.noise[axis].rms, seed)
    taken = [(one, each.share) for one, each in zip(acting, found, strict=False)]
    first, last = found[: len(own)], found[len(parts) :]
    return Divided((*first, *_together(found[len(own) : len(parts)]), *last), taken)


def _together(several: Sequence[Share]) -> list[Share]:
    """Shares of one name as one, whose interval is the sum of theirs: no narrower than it is."""
    found = []
    for name in dict.fromkeys(each.of for each in several):
        own = [each for each in several if each.of == name]
        low, high = (sum(each.ci90[end] for each in own) for end in (0, 1))
        found.append(Share(name, sum(each.share for each in own), (low, min(high, 1.0))))
    return found


def _others(ready: Prepared, gaps: Gaps, axis: str) -> list[tuple[Acting, Part]]:
    """What acts on an axis and is not its own effect, with its torque there."""
    parts = [contributions(ready.simulation, run, gaps.patch) for run in ready.checks]
    nothing = [np.zeros(len(run.recording.time)) for run in ready.checks]
    acting: Sequence[Acting] = (*gaps.patch.effects, *(gaps.patch.heavier or {}))
    found: list[tuple[Acting, Part]] = []
    for number, one in enumerate(acting):
        if isinstance(one, PlacedEffect) and one.axis == axis:
            continue
        felt = [part[number].get(axis, none) for part, none in zip(parts, nothing, strict=True)]
        here = [_felt(run, axis, torque) for run, torque in zip(ready.checks, felt, strict=True)]
        if any(np.any(np.abs(rows) > NO_TORQUE) for rows in here):
            found.append((one, here))
    return found


def _felt(run: Run, axis: str, torque: Array) -> Array:
    """A torque (n,) over the samples in use, as the gap has it."""
    own = run.axes[axis]
    return without_level(own, torque)[own.used]
