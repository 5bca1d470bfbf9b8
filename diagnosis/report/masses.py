"""Bodies whose mass differs from the model's: what each takes of the gap, and how far it closes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.report.divided import Divided
from drivetwin.diagnosis.report.gaps import Gaps
from drivetwin.diagnosis.report.prediction import predict
from drivetwin.diagnosis.report.result import TWO_SIDED_90, CorrectedMass, Estimate
from drivetwin.diagnosis.report.shrink import shrink
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.model_file import named_model


def corrected_masses(
    ready: Prepared,
    gaps: Gaps,
    spread: Mapping[int, float],
    weights: Mapping[str, float],
    parts: Mapping[str, Divided],
    instead: Mapping[int, tuple[str, ...]],
    settings: Settings,
) -> tuple[CorrectedMass, ...]:
    """Those of a patch, the largest share first.

    `spread`: standard deviation of each body's share of its mass. `weights`: of each axis that has a gap, of that in all gaps.
    `instead`: effects that each may be.
    """
    found = [
        replace(_one(ready, gaps, body, spread[body], weights, parts, settings), instead=instead.get(body, ()))
        for body in gaps.patch.heavier or {}
    ]
    return tuple(sorted(found, key=lambda one: -one.share))


def _one(
    ready: Prepared,
    gaps: Gaps,
    body: int,
    spread: float,
    weights: Mapping[str, float],
    parts: Mapping[str, Divided],
    settings: Settings,
) -> CorrectedMass:
    heavier = gaps.patch.heavier or {}
    _, model = named_model(ready.simulation.path)
    nominal = float(model.body_mass[body])
    mass, half = (1.0 + heavier[body]) * nominal, TWO_SIDED_90 * spread * nominal
    taken = {axis: weight * parts[axis].share_of_body(body) for axis, weight in weights.items()}
    axis = max(taken, key=lambda each: taken[each])
    rest = replace(gaps.patch, heavier={other: share for other, share in heavier.items() if other != body})
    before = [predict(ready.simulation, run, rest) for run in ready.checks]
    return CorrectedMass(
        model.body(body).name,
        axis,
        Estimate(mass, "kg", (max(mass - half, 0.0), mass + half)),
        nominal,
        sum(taken.values()),
        shrink(before, gaps.unseen, axis, gaps.noise[axis].floor, settings.seed),
    )
