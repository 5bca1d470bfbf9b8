"""The identification's report in words: what a reader sees beside the figures."""

from __future__ import annotations

import pytest

from drivetwin.identification.result import Parameter
from drivetwin.identification.wording import row_of


@pytest.mark.parametrize(
    ("true", "said"), [(1.0, "yes"), (1.0526, "no, by 0.25 %"), (0.9, "no, by 5.56 %"), (0.0, "no"), (None, "")]
)
def test_by_how_much_an_interval_misses_the_true_value(true: float | None, said: str) -> None:
    assert row_of("inertia", Parameter(1.0, "kg", (0.95, 1.05)), true).interval_holds == said
