"""`drivetwin write-friction` on an emulator of another process: read by a foreign master, and kept without power."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import canopen
import pytest
from processes import PATIENCE, drivetwin, emulator

from drivetwin.cli import main
from drivetwin.cli import write_friction as command_module
from drivetwin.controller.dictionary import object_dictionary
from drivetwin.drive_profiles import load_profile

COULOMB, VISCOUS = 20.4, 203.5
RATIO, RATED, TOP_SPEED = 2.0 * 3.141592653589793 / 0.010, 0.4, 0.25
PER_CENT = [100.0 * (COULOMB + VISCOUS * share * TOP_SPEED) / RATIO / RATED for share in (0.0, 0.5, 1.0)]
RPM = [share * TOP_SPEED / 0.010 * 60.0 for share in (0.0, 0.5, 1.0)]


@pytest.fixture
def identified(tmp_path: Path) -> Path:
    """Of the stage, as far as write-friction reads it."""
    path = tmp_path / "identified.json"
    parameters = {"coulomb": {"value": COULOMB, "unit": "N"}, "viscous": {"value": VISCOUS, "unit": "N·s/m"}}
    axes = {"slide": {"joint": "slide", "parameters": parameters}}
    path.write_text(json.dumps({"schema": "identified/1", "machine": "stage", "axes": axes}))
    return path


@contextmanager
def foreign_master(bus: str) -> Iterator[Callable[[int], list[float]]]:
    """Reads the five entries of an object of node 1."""
    network = canopen.Network()
    network.connect(interface="remote", channel=bus, ignore_config=True)
    node = network.add_node(1, object_dictionary(load_profile("servoone")))
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    try:
        yield lambda index: [node.sdo[index][entry].raw for entry in range(1, 6)]
    finally:
        network.disconnect()


def test_what_is_stored_is_there_after_a_power_cycle(identified: Path, tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    command = ("write-friction", identified, "--machine", "stage")
    with emulator("--machine", "stage", "--clock", "sync", "--store", kept) as bus:
        written = drivetwin(*command, "--bus", bus)
        assert (written.status, written.err) == (0, "")
        assert "axis slide (node 1): written and read back" in written.out
    with emulator("--machine", "stage", "--clock", "sync", "--store", kept) as bus:
        with foreign_master(bus) as read:
            assert read(0x2182) == [0.0] * 5
        stored = drivetwin(*command, "--bus", bus, "--store")
        assert (stored.status, stored.err) == (0, "")
        assert "axis slide (node 1): application parameters stored" in stored.out
    with emulator("--machine", "stage", "--clock", "sync", "--store", kept) as bus, foreign_master(bus) as read:
        assert read(0x2182) == pytest.approx([*PER_CENT, 0.0, 0.0])
        assert read(0x2183) == pytest.approx([*RPM, 0.0, 0.0])


def test_a_drive_that_cannot_store_says_so(identified: Path) -> None:
    with emulator("--machine", "stage", "--clock", "sync") as bus:
        ended = drivetwin("write-friction", identified, "--machine", "stage", "--bus", bus, "--store")
    assert ended.status == 2
    assert "axis slide (node 1): written and read back" in ended.out
    assert "storing by 1010h:03 was aborted by the drive: Code 0x06060000" in ended.err


def test_a_physical_bus_needs_a_confirmation(
    identified: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command_module, "is_physical", lambda _bus: True)
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    with emulator("--machine", "stage", "--clock", "sync") as bus:
        line = ["drivetwin", "write-friction", str(identified), "--machine", "stage", "--bus", bus]
        monkeypatch.setattr(sys, "argv", line)
        with pytest.raises(SystemExit):
            main()
        assert "not confirmed" in capfd.readouterr().err
        with foreign_master(bus) as read:
            assert read(0x2182) == [0.0] * 5
        monkeypatch.setattr(sys, "argv", [*line, "--yes"])
        main()
        with foreign_master(bus) as read:
            assert read(0x2182)[:3] == pytest.approx(PER_CENT)


def test_a_dry_run_needs_no_bus(identified: Path) -> None:
    ended = drivetwin("write-friction", identified, "--machine", "stage", "--dry-run")
    assert (ended.status, ended.err) == (0, "")
    assert f"{RPM[2]:.4g}" in ended.out
    assert f"{PER_CENT[2] / 100.0 * RATED:.4g}" in ended.out
    assert "nothing was written" in ended.out
