"""A node that starts itself (CiA 302-2, 1F80h)."""

from __future__ import annotations

from pathlib import Path

import pytest
from canopen_bench import NODE, RESET_NODE, Bench

from drivetwin.emulator.canopen import AbortCode, NmtState, ParameterStore, SdoAbort


@pytest.mark.parametrize(
    ("value", "state"),
    [
        (0, NmtState.PRE_OPERATIONAL),
        (4, NmtState.PRE_OPERATIONAL),
        (8, NmtState.OPERATIONAL),
        (12, NmtState.PRE_OPERATIONAL),
    ],
)
def test_after_its_boot_up(tmp_path: Path, value: int, state: NmtState) -> None:
    """It is stored as any communication parameter, and holds from the next reset on."""
    bench = Bench(store=ParameterStore(tmp_path / "node.json")).boot()
    bench.write(0x1F80, 0, value)
    bench.write(0x1010, 1, int.from_bytes(b"save", "little"))
    assert bench.device.nmt.state is NmtState.PRE_OPERATIONAL
    bench.nmt(RESET_NODE)
    assert bench.device.nmt.state is state
    assert bench.take()[0] == (0x700 + NODE, b"\x00")


@pytest.mark.parametrize("value", [1, 2, 0x10, 0x28, 0x40, 0x100])
def test_what_is_a_masters_is_refused(value: int) -> None:
    with pytest.raises(SdoAbort) as refusal:
        Bench().boot().write(0x1F80, 0, value)
    assert refusal.value.code is AbortCode.INVALID_VALUE


def test_a_drive_type_without_it_waits_for_its_master() -> None:
    assert Bench("servoone").boot().device.nmt.state is NmtState.PRE_OPERATIONAL
