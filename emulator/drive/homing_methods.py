"""The homing methods of CiA 402-2 (clause 'Homing methods', figures of methods 1 to 34) as data.

Whatever side of the switch the axis starts from, a method ends at one edge, crossed in one direction, and where it says so
at the first index pulse after it in the same direction. Methods 17 to 30 are 1 to 14 without the index pulse. Directions are
those of positions in user units: -1 to the left in the figures, +1 to the right.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto

LEFT, RIGHT = -1, 1


class Input(Enum):
    """What a method looks for."""

    NEGATIVE_LIMIT = auto()
    POSITIVE_LIMIT = auto()
    HOME = auto()


@dataclass(frozen=True)
class Edge:
    """`seek` the input in that direction, then `cross` its edge in that one, `onto` or off the switch; then the `index`."""

    input: Input
    seek: int
    cross: int
    onto: bool
    index: bool = True


@dataclass(frozen=True)
class NextIndex:
    """The first index pulse in a direction."""

    cross: int


@dataclass(frozen=True)
class Here:
    """The present position."""


Method = Edge | NextIndex | Here

_WITH_INDEX: dict[int, Edge] = {
    1: Edge(Input.NEGATIVE_LIMIT, seek=LEFT, cross=RIGHT, onto=False),
    2: Edge(Input.POSITIVE_LIMIT, seek=RIGHT, cross=LEFT, onto=False),
    3: Edge(Input.HOME, seek=RIGHT, cross=LEFT, onto=False),
    4: Edge(Input.HOME, seek=RIGHT, cross=RIGHT, onto=True),
    5: Edge(Input.HOME, seek=LEFT, cross=RIGHT, onto=False),
    6: Edge(Input.HOME, seek=LEFT, cross=LEFT, onto=True),
    7: Edge(Input.HOME, seek=RIGHT, cross=LEFT, onto=False),
    8: Edge(Input.HOME, seek=RIGHT, cross=RIGHT, onto=True),
    9: Edge(Input.HOME, seek=RIGHT, cross=LEFT, onto=True),
    10: Edge(Input.HOME, seek=RIGHT, cross=RIGHT, onto=False),
    11: Edge(Input.HOME, seek=LEFT, cross=RIGHT, onto=False),
    12: Edge(Input.HOME, seek=LEFT, cross=LEFT, onto=True),
    13: Edge(Input.HOME, seek=LEFT, cross=RIGHT, onto=True),
    14: Edge(Input.HOME, seek=LEFT, cross=LEFT, onto=False),
}

METHODS: dict[int, Method] = {
    **_WITH_INDEX,
    **{number + 16: replace(edge, index=False) for number, edge in _WITH_INDEX.items()},
    33: NextIndex(LEFT),
    34: NextIndex(RIGHT),
    35: Here(),
    37: Here(),
}
"""By the value of 6098h. 15, 16, 31, 32 are reserved; 36 is not in the standard."""
