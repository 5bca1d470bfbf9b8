"""Measured data lie beside the project; what needs them skips, saying so, where they do not."""

from __future__ import annotations

from pathlib import Path

import pytest

_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


@pytest.fixture(scope="session")
def emps() -> Path:
    """Folder of the EMPS files."""
    return _existing("emps")


@pytest.fixture(scope="session")
def epos() -> Path:
    """Folder of the EPOS lead screw at steady speeds."""
    return _existing("epos_screw_drive_1/steady_state/0.096kg")


def _existing(name: str) -> Path:
    if not (_DATA / name).is_dir():
        pytest.skip(f"measured data {name} are not beside the project")
    return _DATA / name
