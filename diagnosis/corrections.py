"""Parameters of the model that are off, as the effects that put them right."""

from __future__ import annotations

from collections.abc import Iterable

from diagnosis.comparison import Comparison
from diagnosis.nominal import Nominal
from diagnosis.placing import placed
from emulator.effects import PlacedEffect, library


def corrections(comparison: Comparison, nominals: Iterable[Nominal], amounts: Iterable[float]) -> tuple[PlacedEffect, ...]:
    """Friction and inertia of axes with the amounts by which they are off, in their units; bodies and timing have no effect."""
    kinds = library()
    found = []
    for nominal, amount in zip(nominals, amounts, strict=True):
        if nominal.effect is None or nominal.axis is None:
            continue
        value = amount if nominal.effect == "inertia" else max(0.0, nominal.value + amount)
        parameter = kinds[nominal.effect].parameters[0]
        found.append(placed(comparison, nominal.axis, kinds[nominal.effect](**{parameter.name: value})))
    return tuple(found)
