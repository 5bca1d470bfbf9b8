"""A plant that MuJoCo warns of fails its test, and leaves no MUJOCO_LOG.TXT in the folder where the tests run."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import pytest


@pytest.fixture(autouse=True)
def mujoco_warns_of_nothing() -> Iterator[None]:
    """MuJoCo writes its warnings to a file unless someone takes them."""
    warnings: list[str] = []
    mujoco.set_mju_user_warning(warnings.append)
    yield
    mujoco.set_mju_user_warning(None)
    assert warnings == []
