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


def test_file_times_of_a_fast_task_are_exact(tmp_path: Path) -> None:
    """A float holds a file time to 1.6 us only."""
    names = [["Name", "Position", "Name", "Torque"], ["Unit", "rad (Angle)", "Unit", "(None)"]]
    stamps = [FILE_TIME + MS * k // 8 for k in range(40)]
    rows = [[str(stamp), f"{0.1 * k:.1f}", str(stamp), str(k)] for k, stamp in enumerate(stamps)]

    assert import_recording(export(tmp_path, rows, names), mapped()).info.sample_period == 125e-6


def test_a_first_time_with_a_decimal_comma_is_no_header(tmp_path: Path) -> None:
    names = [["Name", "Position", "Name", "Torque"], ["Unit", "rad (Angle)", "Unit", "(None)"]]
    stamps = [f"{0.25 * k + 0.25:g}".replace(".", ",") for k in range(20)]
    rows = [[stamp, str(k), stamp, str(2 * k)] for k, stamp in enumerate(stamps)]

    recording = import_recording(export(tmp_path, rows, names), mapped())

    assert recording.time == pytest.approx(2.5e-4 * np.arange(1, 21))
    assert recording.columns["ram"]["torque"] == pytest.approx(2.0 * np.arange(20))


def test_what_the_map_does_not_name_may_hold_text_and_a_blank_line_ends_nothing(tmp_path: Path) -> None:
    rows = ramps()
    for row in rows:
        row[2] = "n/a"
    rows.insert(20, [""])

    assert len(import_recording(export(tmp_path, rows, SHARED), mapped()).time) == 41


def test_a_channel_with_a_scale_in_the_scope_needs_its_unit_and_a_second_look(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The same header stands above scaled and unscaled values."""
    file = export(tmp_path, ramps(), [*SHARED, ["ScaleFactor", "-1", "1", "ScaleFactor", "1"]])
    with pytest.raises(UserError, match="the file names no unit for column 'Position'; give `unit:` in the map"):
        import_recording(file, mapped())

    columns = {"position": {"column": "Position", "unit": "mrad"}, "torque": {"column": "Torque", "unit": "N·m"}}
    with caplog.at_level(logging.WARNING):
        import_recording(file, mapped(axes={"ram": {"columns": columns}}))
    assert "Position: the export does not say whether its values are scaled already (ScaleFactor -1)" in caplog.text


def test_names_that_occur_twice_are_told_by_their_numbers(tmp_path: Path) -> None:
    twice = [["Name", "Position", "Torque", "Name", "Torque"], *SHARED[1:]]
    with pytest.raises(UserError, match=r"'Torque' names columns 3, 4; give the number in the map instead"):
        import_recording(export(tmp_path, ramps(), twice), mapped())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": {"column": "time", "unit": "ms"}}, r"time\.unit: column `time` of an export of TwinCAT Scope is in s"),
        ({"csv": {"first_row": 12}}, r"csv: scope\.csv is an export of TwinCAT Scope, which tells its layout itself"),
    ],
)
def test_keys_of_another_table_are_refused(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=message):
        import_recording(export(tmp_path, ramps(), SHARED), mapped(**change))


def test_an_export_is_recognised_and_any_other_table_is_none(tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    own = export(tmp_path, ramps(), SHARED)

    for encoding in ("utf-8", "utf-8-sig", "utf-16"):
        own.write_text(own.read_text(encoding="utf-8"), encoding=encoding)
        assert isinstance(format_of(own, mapped()), TwinCat)
        assert len(import_recording(own, mapped()).time) == 41
        own.write_text(own.read_text(encoding=encoding), encoding="utf-8")
    for first in ("Name;Position;Torque", "NameTag,StartTime,Position"):
        other.write_text(f"{first}\n0;1;2\n1;2;3\n", encoding="utf-8")
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
        ("\t8.0\t", "\t8.0\t1\t2\t3\t4\t", r"row 14 has 9 cells, the header 5"),
        (str(FILE_TIME), "9" * 25, r"no row 'Starttime of export' with a file time"),
    ],
)
def test_what_is_no_export_is_one_line(find: str, by: str, message: str, tmp_path: Path) -> None:
    file = export(tmp_path, ramps(), SHARED)
    file.write_text(file.read_text(encoding="utf-8").replace(find, by), encoding="utf-8")

    with pytest.raises(UserError, match=message) as told:
        import_recording(file, mapped(format="twincat"))
    assert "\n" not in str(told.value)
