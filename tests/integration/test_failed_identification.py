"""An identification that fails leaves no results, but the bus log, in which the trouble is."""

from __future__ import annotations

from pathlib import Path

import can
from processes import PATIENCE, emulator, start, wait_for

from drivetwin.bus.channel import open_bus

SYNC = 0x80
ENOUGH = 400
"""Cycles before the drives are gone."""


def test_the_bus_log_of_drives_that_went_away_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "out" / "run"
    with emulator("--machine", "stage", "--clock", "sync") as bus:
        witness = open_bus(bus)
        controller = start("identify", "--machine", "stage", "--clock", "sync", "--bus", bus, "--out", out)
        wait_for(witness, ENOUGH, lambda frame: frame.arbitration_id == SYNC)
        witness.shutdown()
    _, err = controller.communicate(timeout=PATIENCE)
    kept = tmp_path / "out" / "run.failed.log"
    assert controller.returncode == 2
    assert err.endswith(f"; the bus log until then: {kept}\n")
    assert err.count("\n") == 1
    assert list((tmp_path / "out").iterdir()) == [kept]
    syncs = sum(frame.arbitration_id == SYNC for frame in can.CanutilsLogReader(kept))
    assert syncs >= ENOUGH
