"""TwinCAT Scope exports, laid out as Scope View writes them: time columns, rates, decimal signs, file times, and bad files."""

from __future__ import annotations

import logging
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats.csv_table import Csv
from drivetwin.recording.formats.library import format_of
from drivetwin.recording.formats.twincat import TwinCat
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.importer import import_recording

START = datetime(2022, 5, 2, 13, 56, 24, 376000, tzinfo=UTC)
FILE_TIME = 132959733843760000
"""The same moment in steps of 100 ns since 1601, as Scope View 3.4 wrote it in a public example."""
MS = 10_000
"""Of a file time."""


def mapped(**changes: Any) -> ImportMap:
    columns = {"position": {"column": "Position"}, "torque": {"column": "Torque", "unit": "N·m"}}
    return ImportMap.model_validate(
        {"machine": "press", "time": {"column": "time"}, "axes": {"ram": {"columns": columns}}, **changes}
    )


def export(folder: Path, rows: list[list[str]], names: list[list[str]], delimiter: str = "\t", end: str = "EOF\n") -> Path:
    """A file with a block about itself, one about its channels, and rows of times and values."""
    about = [["Name", "YT"], ["File", "a.svdx"], ["Starttime of export", str(FILE_TIME), "Montag, 2. Mai 2022", "15:56:24.376"]]
    blocks = ["\n".join(delimiter.join(row) for row in block) for block in (about, names, rows)]
    file = folder / "scope.csv"
    file.write_text("\n\n\n".join(blocks[:2]) + "\n\n" + blocks[2] + "\n" + end, encoding="utf-8")
    return file


SHARED = [
    ["Name", "Position", "Speed", "Name", "Torque"],
    ["SampleTime[ms]", "1", "1", "SampleTime[ms]", "4"],
    ["Unit", "mrad (Angle)", "(None)", "Unit", "(None)"],
]
"""Two channels of 1 ms share a time column, a third of 4 ms has its own."""


def ramps(*, comma: bool = False) -> list[list[str]]:
    """Position 2 t and speed 7 at 1 ms for 40 ms; torque 3 t + 1 at 4 ms, first at -3 ms: t in ms."""
    slow = list(range(-3, 42, 4))
    rows = [
        [str(t), f"{2.0 * t:.1f}", "7", *([str(slow[t]), f"{3.0 * slow[t] + 1.0:.1f}"] if t < len(slow) else [" ", " "])]
        for t in range(41)
    ]
    return [[cell.replace(".", ",") if comma else cell for cell in row] for row in rows]


@pytest.mark.parametrize(("delimiter", "comma"), [("\t", False), ("\t", True), (";", True), (",", False), (":", False)])
def test_channels_of_two_rates_are_rows_of_the_fastest(
    delimiter: str, comma: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = export(tmp_path, ramps(comma=comma), SHARED, delimiter)

    with caplog.at_level(logging.WARNING):
        recording = import_recording(file, mapped(time={"column": "time", "unit": "iso"}))

    assert recording.info.start_time == START
    assert recording.time == pytest.approx(np.arange(41) / 1000.0)
    assert recording.columns["ram"]["position"] == pytest.approx(2e-3 * np.arange(41))
    assert recording.columns["ram"]["torque"] == pytest.approx(3.0 * np.arange(41) + 1.0)
    assert "interpolated onto the fastest channel: Torque (250 Hz)" in caplog.text


def test_each_channel_with_its_own_time_and_whole_file_times(tmp_path: Path) -> None:
    names = [["Name", "Position", "Name", "Torque"], ["Unit", "rad (Angle)", "Unit", "(None)"]]
    stamps = [FILE_TIME + 5 * MS * k for k in range(20)]
    rows = [[str(stamp), f"{0.1 * k:.1f}", str(stamp), str(k)] for k, stamp in enumerate(stamps)]

    recording = import_recording(export(tmp_path, rows, names, end=""), mapped())

    assert recording.time == pytest.approx(0.005 * np.arange(20), abs=2e-6)
    assert recording.info.sample_period == pytest.approx(0.005, rel=1e-3)
    assert recording.columns["ram"]["torque"] == pytest.approx(np.arange(20.0))


def test_an_export_is_recognised_and_any_other_table_is_none(tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("Name;Position;Torque\n0;1;2\n1;2;3\n", encoding="utf-8")

    assert isinstance(format_of(export(tmp_path, ramps(), SHARED), mapped()), TwinCat)
    assert isinstance(format_of(other, mapped()), Csv)


def test_a_gap_of_a_slow_channel_is_not_interpolated(tmp_path: Path) -> None:
    rows = ramps()
    for slow, later in zip(rows[5:12], rows[8:12], strict=False):
        slow[3:] = later[3:]
    for spent in rows[9:12]:
        spent[3:] = [" ", " "]

    with pytest.raises(UserError, match=r"'Torque' has no samples from 0\.013 to 0\.029 s; cut the file at the gap"):
        import_recording(export(tmp_path, rows, SHARED), mapped())


@pytest.mark.parametrize(
    ("find", "by", "message"),
    [
        ("Name\tPosition", "Title\tPosition", r"no row 'Name' that names the channels"),
        ("\t", " ", r"names may contain blanks"),
        ("Starttime of export\t1329", "Starttime of export\tx1329", r"no row 'Starttime of export' with a file time"),
        ("\t8.0\t", "\toff\t", r"column 'Position' row 14: 'off' is not a number"),
    ],
)
def test_what_is_no_export_is_one_line(find: str, by: str, message: str, tmp_path: Path) -> None:
    file = export(tmp_path, ramps(), SHARED)
    file.write_text(file.read_text(encoding="utf-8").replace(find, by), encoding="utf-8")

    with pytest.raises(UserError, match=message) as told:
        import_recording(file, mapped(format="twincat"))
    assert "\n" not in str(told.value)
