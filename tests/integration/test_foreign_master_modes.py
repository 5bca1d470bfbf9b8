"""`canopen`'s own CiA 402 master runs every mode that it knows and the drive type has; the emulator is another process."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from modes_402 import MODES, master_on, modes_of, run_mode
from processes import emulator

PROFILES = ("servoone", "cia402-full")


@pytest.fixture(scope="module", params=PROFILES)
def drive(request: pytest.FixtureRequest) -> Iterator[tuple[str, str]]:
    """A drive type, and the bus on which node 1 is one."""
    with emulator("--machine", "stage", "--profile", request.param, "--clock", "sync") as bus:
        yield request.param, bus


@pytest.mark.parametrize("mode", MODES)
def test_mode_of_operation(drive: tuple[str, str], mode: str) -> None:
    profile, bus = drive
    with master_on("remote", bus, profile) as master:
        run_mode(master, mode)


def test_every_mode_of_the_client_is_run() -> None:
    """CiA 402's, that is: its open-loop modes are not, and BaseNode402 has no name for the bit that would tell them."""
    assert set(MODES) == modes_of("cia402-full")
    assert modes_of("servoone") < modes_of("cia402-full")
