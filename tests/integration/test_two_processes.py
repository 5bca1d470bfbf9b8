"""Controller and emulator as two processes on a shared bus; the truth is known to the emulator alone."""

from __future__ import annotations

import json
from pathlib import Path

import can
import pytest
from processes import drivetwin, emulator

from drivetwin.recording.reader import find_recordings, read_recording


def truth_file(path: Path, coulomb: float, viscous: float) -> Path:
    effects = [
        {"effect": "coulomb", "axis": "slide", "parameters": {"coulomb": {"value": coulomb, "unit": "N"}}},
        {"effect": "viscous", "axis": "slide", "parameters": {"viscous": {"value": viscous, "unit": "N·s/m"}}},
    ]
    path.write_text(json.dumps({"schema": "effects/1", "effects": effects}))
    return path


def test_friction_of_a_machine_that_only_the_emulator_knows(tmp_path: Path) -> None:
    profile, coulomb, viscous = "servoone", 31.7, 118.0
    truth = truth_file(tmp_path / "truth.json", coulomb, viscous)
    out = tmp_path / "out"
    common = ("--machine", "stage", "--profile", profile, "--clock", "sync")
    with emulator(*common, "--truth", truth) as bus:
        done = drivetwin("identify", *common, "--bus", bus, "--out", out)
    assert (done.status, done.err) == (0, "")
    identified = json.loads((out / "identified.json").read_text(encoding="utf-8"))
    slide = identified["axes"]["slide"]
    assert slide["parameters"]["coulomb"]["value"] == pytest.approx(coulomb, rel=0.02)
    assert slide["parameters"]["viscous"]["value"] == pytest.approx(viscous, rel=0.02)
    assert "truth" not in slide
    assert "truth" not in (out / "identified.json").read_text(encoding="utf-8")
    for folder in find_recordings(out / "recordings"):
        assert read_recording(folder)
    nothing_told_the_truth(out / "bus.log", coulomb, viscous)


def nothing_told_the_truth(log: Path, coulomb: float, viscous: float) -> None:
    """No object that the drives told by SDO is the friction, in any unit that a drive could have it in."""
    uploads = [frame for frame in can.CanutilsLogReader(log) if frame.arbitration_id == 0x581]
    assert len(uploads) > 100
    told = set()
    for frame in uploads:
        if frame.data[0] >> 5 == 2:  # an upload's answer
            told |= {
                float(int.from_bytes(frame.data[4:8], "little")),
                float(memoryview(bytes(frame.data[4:8])).cast("f")[0]),
            }
    for value in (coulomb, viscous):
        for unit in (1.0, 1e-3, 1e3, 0.01 / 6.283185307179586, 10.0 / 6.283185307179586):
            assert not any(number == pytest.approx(value * unit, rel=1e-4) for number in told)


def test_lockstep_against_drives_that_keep_time_is_refused(tmp_path: Path) -> None:
    with emulator("--machine", "arm", "--clock", "realtime") as bus:
        done = drivetwin("identify", "--machine", "arm", "--bus", bus, "--clock", "sync", "--out", tmp_path / "out")
    assert done.status == 2
    assert done.err.startswith("drivetwin: axis shoulder (node 1) keeps time by itself")
    assert "give --clock realtime" in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "out").exists()
