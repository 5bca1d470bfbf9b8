"""MDF files, written by asammdf itself: units, conversions, rates, invalid samples, and what is no such file."""

from __future__ import annotations

import logging
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from asammdf import MDF, Signal

from drivetwin.cli import main
from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats import mdf
from drivetwin.recording.formats.mdf import read_mdf
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.importer import import_recording

START = datetime(2026, 3, 4, 5, 6, 7, tzinfo=UTC)
FAST, SLOW = np.arange(2000) * 1e-3, np.arange(200) * 1e-2
MAP: dict[str, Any] = {
    "machine": "bench",
    "time": {"column": "time"},
    "axes": {"x": {"columns": {"torque": {"column": "Torque"}, "position": {"column": "Position"}}}},
}


def mapped(**changes: Any) -> ImportMap:
    return ImportMap.model_validate(MAP | changes)


def with_demand(**changes: Any) -> ImportMap:
    columns = {**MAP["axes"]["x"]["columns"], "position_demand": {"column": "Demand"}}
    return mapped(axes={"x": {"columns": columns}}, **changes)


def position(time: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return np.asarray(30.0 * np.sin(2.0 * np.pi * time))


def torque() -> Signal:
    """Counts of 0.25 N·m, with an offset of 2, as a conversion of the file tells."""
    counts = np.round(40.0 * np.cos(2.0 * np.pi * FAST)).astype(np.int16)
    return Signal(counts, FAST, name="Torque", unit="Nm", conversion={"a": 0.25, "b": 2.0})


def write(path: Path, *groups: list[Signal], version: str = "4.10") -> Path:
    with MDF(version=version) as file:
        file.start_time = START
        for group in groups:
            file.append(group)
        file.save(path, overwrite=True)
    return path


def drive(path: Path, version: str = "4.10") -> Path:
    """Position and torque at 1 kHz, their demand at 100 Hz, and a text beside it."""
    text = Signal(np.array([b"run"] * len(SLOW)), SLOW, name="State", encoding="utf-8")
    fast = [Signal(position(FAST), FAST, name="Position", unit="deg"), torque()]
    return write(path, fast, [Signal(position(SLOW), SLOW, name="Demand", unit="deg"), text], version=version)


@pytest.mark.parametrize(("name", "version"), [("drive.mf4", "4.10"), ("drive.mdf", "3.30")])
def test_channels_of_one_rate_come_as_they_are(name: str, version: str, tmp_path: Path) -> None:
    recording = import_recording(drive(tmp_path / name, version), mapped())
    assert recording.info.sample_period == 0.001
    np.testing.assert_array_equal(recording.time, FAST)
    np.testing.assert_allclose(recording.columns["x"]["position"], np.radians(position(FAST)), atol=1e-15)
    expected = 0.25 * np.round(40.0 * np.cos(2.0 * np.pi * FAST)) + 2.0
    np.testing.assert_array_equal(recording.columns["x"]["torque"], expected)


def test_the_start_is_the_files(tmp_path: Path) -> None:
    recording = import_recording(drive(tmp_path / "drive.mf4"), mapped(time={"column": "time", "unit": "iso"}))
    assert recording.info.start_time == START
    assert recording.info.sample_period == pytest.approx(0.001)


def test_a_slower_channel_is_interpolated_and_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """100 Hz of 30° sin(2 pi t) at 1 kHz: off by A w² h² / 8 at most; the rows end where its last sample is."""
    with caplog.at_level(logging.WARNING):
        recording = import_recording(drive(tmp_path / "drive.mf4"), with_demand())
    assert "interpolated onto the fastest channel: Demand (100 Hz)" in caplog.text
    assert recording.time[-1] == pytest.approx(1.99)
    off = recording.columns["x"]["position_demand"] - recording.columns["x"]["position"]
    assert np.abs(off).max() == pytest.approx(np.radians(30.0) * (2.0 * np.pi * 0.01) ** 2 / 8.0, rel=0.02)


def test_nothing_is_interpolated_across_a_gap(tmp_path: Path) -> None:
    cut = np.delete(SLOW, range(50, 60))
    fast = [Signal(position(FAST), FAST, name="Position", unit="deg"), torque()]
    file = write(tmp_path / "drive.mf4", fast, [Signal(position(cut), cut, name="Demand", unit="deg")])
    with pytest.raises(UserError, match=r"channel 'Demand' has no samples from 0\.49 to 0\.6 s"):
        import_recording(file, with_demand())


def test_invalid_samples_are_a_gap(tmp_path: Path) -> None:
    """The file says of each sample whether it is valid."""
    wrong = np.zeros(len(FAST), dtype=bool)
    wrong[700:720] = True
    read = Signal(position(FAST), FAST, name="Position", unit="deg", invalidation_bits=wrong)
    file = write(tmp_path / "drive.mf4", [read, torque()])
    _, channels = read_mdf(file)
    assert [len(channel.time) for channel in channels] == [1980, 2000]
    with pytest.raises(UserError, match=r"channel 'Position' has no samples from 0\.699 to 0\.72 s"):
        import_recording(file, mapped())


def test_names_that_are_not_there_or_twice(tmp_path: Path) -> None:
    file = write(tmp_path / "drive.mf4", *([Signal(position(FAST), FAST, name="Position", unit="deg")] for _ in range(2)))
    with pytest.raises(UserError, match=r"no column 'Torque' for x\.torque; the columns are: time, Position, Position;"):
        import_recording(file, mapped(axes={"x": {"columns": {"torque": {"column": "Torque"}, "position": {"column": 2}}}}))
    with pytest.raises(UserError, match="'Position' names columns 2, 3; give the number in the map instead"):
        import_recording(file, mapped())


def test_a_unit_that_the_file_lacks_is_the_maps(tmp_path: Path) -> None:
    file = write(tmp_path / "drive.mf4", [Signal(position(FAST), FAST, name="Position"), torque()])
    with pytest.raises(UserError, match="the file names no unit for column 'Position'"):
        import_recording(file, mapped())


@pytest.mark.parametrize("content", [b"", b"MDF     4.10    ", b"t;M\n0;1\n" * 100])
def test_what_is_no_mdf_file_is_one_line(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "drive.mf4"
    file.write_bytes(content)
    with pytest.raises(UserError, match=r"drive\.mf4 cannot be read as an MDF file: ") as told:
        import_recording(file, mapped())
    assert "\n" not in str(told.value)


def test_a_torn_file_is_refused(tmp_path: Path) -> None:
    whole = drive(tmp_path / "whole.mf4").read_bytes()
    file = tmp_path / "torn.mf4"
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UserError, match=r"torn\.mf4 cannot be read as an MDF file: ") as told:
        import_recording(file, mapped())
    assert "\n" not in str(told.value)


def test_without_the_library_its_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = drive(tmp_path / "drive.mf4")
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(MAP), encoding="utf-8")
    monkeypatch.setattr(mdf, "find_spec", {}.get)
    monkeypatch.setattr(
        sys, "argv", ["drivetwin", "import", str(file), "--map", str(tmp_path / "map.yaml"), "--out", str(tmp_path / "out")]
    )
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "asammdf, which is not installed: pip install 'drivetwin[formats]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
