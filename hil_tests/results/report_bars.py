"""How close a figure is to its limit, as a number and as a bar."""

from __future__ import annotations

from math import inf, isfinite, isnan

from drivetwin.hil_tests.verdict import Measured


def used(measured: Measured) -> float:
    """Share of the limit that is used, beyond 1 where it is not kept; infinite for what never came about."""
    limit = measured.limit or 0.0
    if isnan(measured.value) or limit <= 0.0 < measured.value:
        return inf
    return max(0.0, measured.value / limit) if limit > 0.0 else 0.0


def bar(share: float) -> str:
    """The bar, red where the limit is not kept."""
    over = " over" if share > 1.0 else ""
    return f'<span class="bar{over}"><i style="width:{100.0 * min(share, 1.0):.1f}%"></i></span>'


def share_words(share: float) -> str:
    """`62 %`, or that it is beyond any."""
    return f"{100.0 * share:.0f} %" if isfinite(share) else "not kept"
