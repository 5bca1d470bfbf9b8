"""`drivetwin identify` in one process, from the command line to the files."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.recording.reader import find_recordings, read_recording


def test_an_arm_with_another_truth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    coulomb, viscous = 2.3, 0.9
    effects = [
        {"effect": "coulomb", "axis": "shoulder", "parameters": {"coulomb": {"value": coulomb, "unit": "N·m"}}},
        {"effect": "viscous", "axis": "shoulder", "parameters": {"viscous": {"value": viscous, "unit": "N·m·s/rad"}}},
    ]
    truth = tmp_path / "truth.json"
    truth.write_text(json.dumps({"schema": "effects/1", "effects": effects}))
    out = tmp_path / "out"
    command = f"drivetwin identify --machine arm --profile cia402-full --truth {truth} --out {out} --seed 3"
    monkeypatch.setattr(sys, "argv", command.split())
    main()
    assert capfd.readouterr().err == ""
    identified = json.loads((out / "identified.json").read_text(encoding="utf-8"))
    assert identified["schema"] == "identified/1"
    assert identified["seed"] == 3
    shoulder = identified["axes"]["shoulder"]
    assert shoulder["parameters"]["coulomb"]["value"] == pytest.approx(coulomb, rel=0.02)
    assert shoulder["parameters"]["viscous"]["value"] == pytest.approx(viscous, rel=0.02)
    assert shoulder["truth"]["coulomb"] == coulomb
    names = {folder.name for folder in find_recordings(out / "recordings")}
    assert names == {"strokes_shoulder", "excitation_shoulder", "validation_shoulder"}
    for name in names:
        (recording,) = read_recording(out / "recordings" / name)
        assert recording.info.axes["shoulder"].torque_resolution
    assert (out / "report.html").stat().st_size > 10_000
    assert list(out.glob("*.png"))
    assert [entry.name for entry in tmp_path.iterdir() if entry.name.startswith(".")] == []
