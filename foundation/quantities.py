"""A quantity for a reader: in the unit that fits its size, with the digits that its interval supports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

_FINER = {
    "N·m": (("N·m", 1.0), ("mN·m", 1e3), ("µN·m", 1e6)),
    "N": (("N", 1.0), ("mN", 1e3)),
    "m": (("m", 1.0), ("mm", 1e3), ("µm", 1e6)),
    "rad": (("rad", 1.0), ("mrad", 1e3), ("µrad", 1e6)),
    "m/s": (("m/s", 1.0), ("mm/s", 1e3), ("µm/s", 1e6)),
    "rad/s": (("rad/s", 1.0), ("mrad/s", 1e3)),
    "s": (("s", 1.0), ("ms", 1e3), ("µs", 1e6)),
    "kg": (("kg", 1.0), ("g", 1e3)),
    "kg·m²": (("kg·m²", 1.0), ("kg·cm²", 1e4), ("g·cm²", 1e7)),
    "N·m·s/rad": (("N·m·s/rad", 1.0), ("mN·m·s/rad", 1e3), ("µN·m·s/rad", 1e6)),
    "N·s/m": (("N·s/m", 1.0), ("mN·s/m", 1e3)),
}
_SMALLEST_SHOWN = 0.1
"""Below it a finer unit is taken."""


@dataclass(frozen=True)
class Scale:
    """A unit for display: a value in SI units times `factor` is in `unit`, which is empty for a number without one."""

    unit: str
    factor: float


def scale_of(unit: str, largest: float) -> Scale:
    """The unit in which a quantity of this size reads well; an unknown unit stays as it is, and "1" is no unit."""
    known = _FINER.get(unit, (("" if unit == "1" else unit, 1.0),))
    for name, factor in known:
        if abs(largest) * factor >= _SMALLEST_SHOWN or not largest:
            return Scale(name, factor)
    return Scale(*known[-1])


def short(value: float) -> float:
    """Of four digits: more than anybody commissions or reads."""
    return float(f"{value:.4g}")


def number(value: float, digits: int = 3) -> str:
    """Significant digits, and never an exponent for what a person can read without."""
    rounded = f"{value:.{digits}g}"
    return f"{float(rounded):.0f}" if "e+" in rounded and abs(value) < 1e6 else rounded


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A value in the unit that fits its size.

    >>> quantity(0.00231, "N·m")
    '2.31 mN·m'
    """
    scale = scale_of(unit, value)
    return f"{number(scale.factor * value, digits)} {scale.unit}".rstrip()


def span(low: float, high: float, unit: str, digits: int = 4) -> str:
    """Both ends of an interval in the unit that fits the larger.

    >>> span(-0.05, 0.05, "s")
    '-50 to 50 ms'
    """
    scale = scale_of(unit, max(abs(low), abs(high)))
    return f"{number(scale.factor * low, digits)} to {number(scale.factor * high, digits)} {scale.unit}".rstrip()


def decimals_for(half_width: float, largest: float) -> int:
    """Decimals that show two digits of an interval's half width; five digits of the value where there is no interval."""
    first = math.floor(math.log10(half_width)) - 1 if half_width > 0.0 and math.isfinite(half_width) else None
    if first is None:
        first = math.floor(math.log10(abs(largest))) - 4 if largest else 0
    return min(max(-first, 0), 9)


def with_interval(value: float, interval: Sequence[float], unit: str, *more: float) -> tuple[list[str], str]:
    """Value, both ends of its interval and `more` values of the same unit as text, and the unit they are in.

    >>> with_interval(0.00231, (0.0022, 0.0024), "N·m", 0.0023)
    (['2.31', '2.20', '2.40', '2.30'], 'mN·m')
    """
    scale = scale_of(unit, max(abs(each) for each in (value, *more)))
    low, high = interval
    decimals = decimals_for(scale.factor * (high - low) / 2.0, scale.factor * value)
    return [f"{scale.factor * each:.{decimals}f}" for each in (value, low, high, *more)], scale.unit
