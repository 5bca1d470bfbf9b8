"""Shares of cases with their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

_Z90 = 1.6448536269514722
"""Two-sided 90 % of the normal distribution."""


@dataclass(frozen=True)
class Rate:
    """`hits` of `of` cases."""

    hits: int
    of: int

    @property
    def value(self) -> float | None:
        """The share; None without any case."""
        return self.hits / self.of if self.of else None

    @property
    def ci90(self) -> tuple[float, float] | None:
        """Two-sided 90 % score interval of a binomial share (Wilson 1927); None without any case."""
        if not self.of:
            return None
        share, z2 = self.hits / self.of, _Z90**2 / self.of
        centre = share + z2 / 2.0
        half = _Z90 * math.sqrt(share * (1.0 - share) / self.of + z2 / (4.0 * self.of))
        return max(0.0, (centre - half) / (1.0 + z2)), min(1.0, (centre + half) / (1.0 + z2))


def rate(hits: Iterable[bool]) -> Rate:
    """How many of `hits` are true."""
    listed = list(hits)
    return Rate(sum(listed), len(listed))
