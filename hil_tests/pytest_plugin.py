"""`pytest --bench bench.yaml`: the acceptance suite within pytest. Without --bench it does nothing, and loads nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

OUT = Path("out/accept")


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options."""
    group = parser.getgroup("drivetwin", "acceptance of a controller")
    group.addoption("--bench", type=Path, metavar="FILE", help="the bench (bench/1) on which the suite runs")
    group.addoption("--bench-out", type=Path, metavar="DIR", default=OUT, help=f"where the cases' folders appear ({OUT})")


def pytest_configure(config: pytest.Config) -> None:
    """Load the suite where a bench is given."""
    if config.getoption("--bench") is not None:
        config.pluginmanager.import_plugin("drivetwin.hil_tests.pytest_suite")
