"""Effects as a mechanism takes them: with the units of their axis, in the order in which torque passes them."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.emulator.effects import FAMILIES, Effect, PlacedEffect

Name = tuple[str, str]
"""Of an effect, and its axis."""


def name_of(one: PlacedEffect) -> Name:
    """Of an effect on its axis."""
    return one.effect.name, one.axis


def in_order(effects: Sequence[PlacedEffect]) -> tuple[PlacedEffect, ...]:
    """Effects in the order in which torque passes them, what the model has first."""
    return tuple(sorted(effects, key=lambda one: (FAMILIES.index(one.effect.family), not one.effect.of_model)))


def placed(rows: Rows, axis: str, effect: Effect) -> PlacedEffect:
    """An effect on an axis, its parameters' units filled in."""
    joint = rows.simulation.model.joint(rows.simulation.drives[axis].joint)
    units = {parameter.name: parameter.unit.on(int(joint.type[0])) for parameter in type(effect).parameters}
    return PlacedEffect(axis, effect, units)


def alike(one: PlacedEffect, other: PlacedEffect) -> bool:
    """The same effect on the same axis, its parameters settled since; of those that repeat, the same order."""
    if (one.effect.name, one.axis) != (other.effect.name, other.axis):
        return False
    order = getattr(one.effect, "order", None)
    return order is None or abs(order - getattr(other.effect, "order", 0.0)) < 0.05 * order
