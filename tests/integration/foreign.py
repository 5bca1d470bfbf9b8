"""Clients that this project did not write: where `scripts/vcan/install-foreign` puts them, what a missing one means."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NoReturn

import pytest

FOREIGN = Path(__file__).parents[2] / "out" / "foreign"


def missing(client: str, remedy: str) -> NoReturn:
    """A client that is not here fails a test in CI, which installs it, and skips the test elsewhere."""
    reason = f"{client} is not here: {remedy}"
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


def installed(name: str) -> Path:
    """Path of what `install-foreign` has installed, below out/foreign."""
    path = FOREIGN / name
    if not path.exists():
        missing(path.name, "run scripts/vcan/install-foreign, which needs cargo, node and npm")
    return path
