"""`canopen`'s CiA 402 master runs every mode that it knows and the drive type has, over a real SocketCAN bus."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from modes_402 import MODES, master_on, run_mode
from processes import emulator


@pytest.fixture(scope="module", params=["servoone", "cia402-full"])
def drive(request: pytest.FixtureRequest) -> Iterator[str]:
    """A drive type, of which node 1 on vcan0 is one."""
    with emulator("--machine", "stage", "--profile", request.param, "--clock", "sync", bus="vcan0"):
        yield request.param


@pytest.mark.parametrize("mode", MODES)
def test_mode_of_operation(drive: str, mode: str) -> None:
    with master_on("socketcan", "vcan0", drive) as master:
        run_mode(master, mode)
