"""What may be drawn, and which kinds of case with which effects: every effect goes round as often as any other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivetwin.blind.case import Kind
from drivetwin.blind.wide.effects import LIBRARY, suits
from drivetwin.blind.wide.families import FAMILIES, draw_family
from drivetwin.blind.wide.foreign import FOREIGN
from drivetwin.blind.wide.machines import Draw, Machine
from drivetwin.blind.wide.robots import ROBOTS, robot_files
from drivetwin.foundation.errors import UserError

SHARES: dict[Kind, float] = {"double": 0.15, "four": 0.05, "clean": 0.15, "foreign": 0.15}
"""Of all cases; the rest have one cause."""

WEIGHTS = {"rotary": 1.0, "pendulum": 1.0, "linear": 1.0, "lift": 0.8, "gantry": 0.8, "arm2": 0.8, "arm3": 0.8, "scara": 0.8}
"""How often a family is drawn; 0.6 for those that are not named, 3 for public robots together."""

FOUR = 4
SEEN = 8
"""Machines of a family that show which effects it can have: what differs between them is a coin that is tossed."""


@dataclass(frozen=True)
class Choice:
    """What may be drawn: machine families, effects of the library, foreign ones; `robots` holds public models, None without."""

    families: tuple[str, ...]
    effects: tuple[str, ...]
    foreign: tuple[str, ...]
    robots: Path | None = None


def choice(only: Sequence[str] = (), without: Sequence[str] = (), robots: Path | None = None) -> Choice:
    """What is left of all families and effects; `only` keeps what it names of each kind of name that it names at all.

    Effects that no machine of these families can have are left out. Raises UserError for a name that there is not, where
    nothing is left of a kind, and for an effect in `only` that none of the families can have.
    """
    groups = (tuple(FAMILIES) + ((ROBOTS,) if robots else ()), tuple(LIBRARY), tuple(FOREIGN))
    known = {name for group in groups for name in group}
    for name in (*only, *without):
        if name not in known:
            raise UserError(f"{name}: no family or effect of this generator; there are {', '.join(sorted(known))}")
    kept = []
    for group in groups:
        named = tuple(name for name in group if name in only) or group
        left = tuple(name for name in named if name not in without)
        if not left:
            raise UserError(f"nothing is left to draw of {', '.join(group)}; name fewer families or effects")
        kept.append(left)
    machines = _some(kept[0])
    able = [tuple(name for name in names if _can_have(name, machines)) for names in kept[1:]]
    refused = [name for names, left in zip(kept[1:], able, strict=True) for name in names if name not in left]
    if asked := [name for name in refused if name in only]:
        raise UserError(f"no machine of {', '.join(kept[0])} can have {', '.join(asked)}; allow more families")
    return Choice(kept[0], able[0], able[1], robots)


def _some(families: Sequence[str]) -> list[Machine] | None:
    """Some machines of each family, which show what they can have; None with public robots, which may have anything."""
    if ROBOTS in families:
        return None
    return [draw_family(np.random.default_rng(number), name) for name in families for number in range(SEEN)]


def _can_have(effect: str, machines: Sequence[Machine] | None) -> bool:
    return machines is None or any(suits(effect, one, axis) for one in machines for axis in range(len(one.links)))


def plans(draw: Draw, count: int, allowed: Choice) -> list[tuple[Kind, tuple[str, ...]]]:
    """Kind of each case and its effects; singles, pairs and foreign ones go round their lists.

    Where no family has four axes, the cases that would need them have one cause.
    """
    effects, foreign = _round(draw, allowed.effects), _round(draw, allowed.foreign)
    counts = {kind: int(share * count + 0.5) for kind, share in SHARES.items()}
    machines = _some(allowed.families)
    if machines is not None and all(len(one.links) < FOUR for one in machines):
        counts["four"] = 0
    counts["single"] = count - sum(counts.values())
    drawn: list[tuple[Kind, tuple[str, ...]]] = []
    for kind, number in counts.items():
        for _ in range(number):
            drawn.append((kind, _effects_of(kind, effects, foreign)))
    return drawn


def _effects_of(kind: Kind, effects: Iterator[str], foreign: Iterator[str]) -> tuple[str, ...]:
    match kind:
        case "clean":
            return ()
        case "foreign":
            return (next(foreign),)
        case "double":
            return (next(effects), next(effects))
        case "four":
            return tuple(next(effects) for _ in range(FOUR))
        case _:
            return (next(effects),)


def _round(draw: Draw, names: Sequence[str]) -> Iterator[str]:
    while True:
        yield from (names[index] for index in draw.permutation(len(names)))


def family(draw: Draw, allowed: Choice) -> str:
    """A family's name, of a public robot its file's."""
    weights = np.array([3.0 if name == ROBOTS else WEIGHTS.get(name, 0.6) for name in allowed.families])
    name = allowed.families[int(draw.choice(len(weights), p=weights / weights.sum()))]
    if name != ROBOTS:
        return name
    assert allowed.robots is not None
    return str(draw.choice(robot_files(allowed.robots)))
