"""Tests on a real SocketCAN interface; `make test-vcan` brings one up where the kernel has none."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without vcan0 these tests cannot run, and say how they can."""
    if not Path("/sys/class/net/vcan0").exists():
        for item in items:
            if Path(__file__).parent in item.path.parents:
                item.add_marker(pytest.mark.skip(reason="no vcan0 here; `make test-vcan` boots a kernel that has one"))


@pytest.fixture(autouse=True)
def _interface_is_up() -> None:
    """A test that finds its interface down would blame the product."""
    state = subprocess.run(["ip", "-br", "link", "show", "vcan0"], capture_output=True, text=True, check=True)
    assert "UP" in state.stdout or "UNKNOWN" in state.stdout, state.stdout
