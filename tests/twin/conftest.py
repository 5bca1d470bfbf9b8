"""A machine made of a model once, and a copy of it for each test to change."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from new_machine_bench import made_gantry


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_gantry(tmp_path_factory.mktemp("gantry"))


@pytest.fixture
def made(made_once: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made_once, tmp_path / "made"))
