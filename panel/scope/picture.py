"""What a screen can show of samples: the smallest and the largest of each column, so that no peak is lost."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from math import isnan

import numpy as np

from drivetwin.panel.scope.ring import Samples

COLUMNS = 300
"""Two instants each, where its smallest and its largest value are drawn: in the middle of each half."""

MOST_POINTS = 600
"""Of an XY plot."""


@dataclass(frozen=True)
class Span:
    """A stretch of time on the screen, `start` to `end` [s]."""

    start: float
    end: float


def envelope(times: Samples, values: Samples, span: Span) -> Samples:
    """The smallest and the largest value of each column (2 n,), in the order in which the curve goes from one to the other.

    NaN in a column without a sample. `times` rise.
    """
    drawn = np.full((COLUMNS, 2), np.nan)
    places = np.searchsorted(times, np.linspace(span.start, span.end, COLUMNS + 1))
    places[-1] = np.searchsorted(times, span.end, "right")
    filled = np.flatnonzero(places[1:] > places[:-1])
    if filled.size:
        firsts = places[filled]
        shown = values[: places[-1]]
        falls = shown[firsts] > shown[np.append(firsts[1:], len(shown)) - 1]
        drawn[filled, falls.astype(int)] = np.minimum.reduceat(shown, firsts)
        drawn[filled, 1 - falls] = np.maximum.reduceat(shown, firsts)
    return drawn.ravel()


def pairs(x: tuple[Samples, Samples], y: tuple[Samples, Samples]) -> tuple[Samples, Samples]:
    """(n,) values of x and y at the same instants, n at most `MOST_POINTS`: at each of y's times the last value of x."""
    places = np.searchsorted(x[0], y[0], "right") - 1
    known = np.flatnonzero(places >= 0)
    known = known[:: -(-len(known) // MOST_POINTS) or 1]
    return x[1][places[known]], y[1][known]


def packed(values: Samples) -> str:
    """For JSON, as the page unpacks it: 32-bit floating point, little-endian, in base64; NaN where there is none."""
    return b64encode(values.astype("<f4").tobytes()).decode("ascii")


def told(values: Samples) -> list[float | None]:
    """For JSON: seven digits, None in the place of NaN."""
    return [None if isnan(value) else float(f"{value:.7g}") for value in values.tolist()]
