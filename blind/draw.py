"""Draws the cases of a blind test: machines, and effects whose sizes an engineer would say matter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from drivetwin.blind.case import FOREIGN, Case, Cause, Kind
from drivetwin.blind.foreign import FOREIGN_EFFECTS
from drivetwin.blind.levels import Levels, levels_of
from drivetwin.blind.machines import DrawnMachine, draw_machine
from drivetwin.blind.plants import FORMULATIONS, LIBRARY, has_formulations
from drivetwin.blind.sizes import draw_cause, draw_foreign, drawable, suits
from drivetwin.emulator.effects import Effect

Draw = np.random.Generator

SHARES: dict[Kind, float] = {"clean": 50 / 300, "foreign": 50 / 300, "double": 40 / 300, "single": 160 / 300}
"""Of all cases."""

MACHINES = {"arm": 0.17, "turntable": 0.15, "stage": 0.17, "lift": 0.16, "elbow": 0.2, "scara3": 0.15}
"""How often each family is drawn."""


def draw_cases(count: int, seed: int) -> tuple[Case, ...]:
    """`count` cases in a shuffled order, the same ones for the same count and seed.

    Kinds by `SHARES`; the single effects, the first ones of the pairs and the foreign ones go round their lists, so that each
    comes as often as any other, give or take one. An effect that no plant of the blind test has a formulation of stands in the
    emulator's own.
    """
    draw = np.random.default_rng([seed, 0])
    plans = _plans(draw, count)
    draw.shuffle(plans)
    seeds = draw.choice(2**31, size=count, replace=False)
    return tuple(_case(number, int(own), *plan) for number, (own, plan) in enumerate(zip(seeds, plans, strict=True)))


def _plans(draw: Draw, count: int) -> list[tuple[Kind, str | None]]:
    """Kind of each case, and the effect that it is about."""
    counts = _counts(count)
    effects, foreign = _round(draw, list(drawable())), _round(draw, [FOREIGN + name for name in FOREIGN_EFFECTS])
    kinds = [kind for kind, number in counts.items() for _ in range(number)]
    return [(kind, next(foreign) if kind == "foreign" else _next_for(kind, effects)) for kind in kinds]


def _next_for(kind: Kind, effects: Iterator[str]) -> str | None:
    """The effect that the next case of a kind is about, the first of two in a pair."""
    if kind == "double":
        return next(effect for effect in effects if not drawable()[effect].stops)
    return next(effects) if kind == "single" else None


def _counts(count: int) -> dict[Kind, int]:
    """Cases of each kind, rounded down; what is left over are singles."""
    counts: dict[Kind, int] = {kind: int(share * count + 1e-9) for kind, share in SHARES.items()}
    counts["single"] += count - sum(counts.values())
    return {"single": counts["single"], "double": counts["double"], "clean": counts["clean"], "foreign": counts["foreign"]}


def _round(draw: Draw, names: Sequence[str]) -> Iterator[str]:
    """All names in a random order, and again."""
    while True:
        yield from (names[index] for index in draw.permutation(len(names)))


def _case(number: int, seed: int, kind: Kind, effect: str | None) -> Case:
    draw = np.random.default_rng([seed, 0])
    family, machine = _machine_for(draw, seed, effect)
    causes = () if effect is None else _causes(draw, kind, effect, machine, levels_of(machine, seed))
    formulation = str(draw.choice(list(FORMULATIONS)))
    return Case(number, seed, family, kind, causes, formulation if all(map(has_formulations, causes)) else LIBRARY)


def _causes(draw: Draw, kind: Kind, effect: str, machine: DrawnMachine, levels: dict[str, Levels]) -> tuple[Cause, ...]:
    axis = _axis_for(draw, machine, effect)
    if kind == "foreign":
        return (draw_foreign(draw, effect, axis, machine, levels),)
    first = draw_cause(draw, effect, axis, machine, levels)
    return (first, _another(draw, first, machine, levels)) if kind == "double" else (first,)


def _machine_for(draw: Draw, seed: int, effect: str | None) -> tuple[str, DrawnMachine]:
    """A machine of a random family on some axis of which the effect makes sense."""
    while True:
        family = str(draw.choice(list(MACHINES), p=list(MACHINES.values())))
        machine = draw_machine(family, seed)
        if effect is None or any(suits(effect, machine, axis) for axis in machine.axes):
            return family, machine


def _axis_for(draw: Draw, machine: DrawnMachine, effect: str) -> str:
    return str(draw.choice([axis for axis in machine.axes if suits(effect, machine, axis)]))


def _another(draw: Draw, first: Cause, machine: DrawnMachine, levels: dict[str, Levels]) -> Cause:
    """A second cause: of another family or on another axis, none that could be mistaken for the first, none that stops it."""
    choices = [
        (name, axis)
        for name, kind in drawable().items()
        for axis in machine.axes
        if suits(name, machine, axis) and _may_join(kind, axis, first)
    ]
    effect, axis = choices[int(draw.integers(len(choices)))]
    return draw_cause(draw, effect, axis, machine, levels)


def _may_join(kind: type[Effect], axis: str, first: Cause) -> bool:
    """Whether an effect on an axis makes a pair with the first cause."""
    other = drawable()[first.effect]
    if kind is other or kind.stops or kind.looks & other.looks:
        return False
    return axis != first.axis or (kind.family != other.family and not (kind.rings and other.rings))
