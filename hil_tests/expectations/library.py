"""All expectations: one file each in this folder, and those of installed packages."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from drivetwin.foundation.plugins import Plugins
from drivetwin.hil_tests.expectations.base import Expectation

EXPECTATIONS: Plugins[Expectation] = Plugins(
    "expectation", Expectation, "drivetwin.hil_tests.expectations", "drivetwin.expectations", "docs/acceptance.md"
)


@cache
def library() -> Mapping[str, type[Expectation]]:
    """Every expectation by its name."""
    return EXPECTATIONS.found()
