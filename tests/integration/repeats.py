"""How often a claim is repeated: for one case in `make test`, for all of them in `make test-long`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TypeVar

Case = TypeVar("Case")

LONG = "DRIVETWIN_LONG" in os.environ


def repeated(*cases: Case) -> Sequence[Case]:
    """The first of the cases, or all of them."""
    return cases if LONG else cases[:1]
