"""`drivetwin import --repair`: what it sets right, and what it leaves to be refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer import Typer
from typer.testing import CliRunner, Result

from drivetwin.cli.import_ import import_command
from drivetwin.foundation.errors import UserError
from drivetwin.recording.import_map import read_map
from drivetwin.recording.importer import import_recording
from drivetwin.recording.reader import read_recording

MAP = """\
machine: bench
time: {column: t, unit: s}
axes:
  x: {columns: {torque: {column: M, unit: N·m}, position: {column: q, unit: rad}}}
"""
ROWS = [f"{k * 0.01:.2f};{2 * k};{k * k}" for k in range(8)]


def imported(rows: list[str], folder: Path, *options: str) -> Result:
    (folder / "scope.csv").write_text("\n".join(["t;M;q", *rows]) + "\n")
    (folder / "map.yaml").write_text(MAP)
    app = Typer()
    app.command()(import_command)
    files = [str(folder / "scope.csv"), "--map", str(folder / "map.yaml"), "--out", str(folder / "out")]
    return CliRunner().invoke(app, [*files, *options])


def test_rows_twice_and_a_missing_sample(tmp_path: Path) -> None:
    rows = [*ROWS[:3], ROWS[2], ROWS[2], "0.03;;9", *ROWS[4:]]
    refused = imported(rows, tmp_path)
    assert isinstance(refused.exception, UserError)
    assert "--repair" in str(refused.exception)
    done = imported(rows, tmp_path, "--repair")
    assert done.exit_code == 0, done.exception
    (read,) = read_recording(tmp_path / "out")
    np.testing.assert_allclose(read.columns["x"]["torque"], 2.0 * np.arange(8))
    np.testing.assert_allclose(read.columns["x"]["position"], np.arange(8.0) ** 2)
    assert json.loads((tmp_path / "out" / "recording.json").read_text())["repaired"] == {"rows": 2, "x.torque": 1}


def test_a_sound_file_is_left_as_it_is(tmp_path: Path) -> None:
    assert imported(ROWS, tmp_path, "--repair").exit_code == 0
    assert "repaired" not in json.loads((tmp_path / "out" / "recording.json").read_text())


def test_rows_without_a_number_at_both_ends_are_cut_off(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A drive answers later than the recorder starts, and not all its columns at once; its clock ends first."""
    rows = ["0.00;;", "0.01;;1", *ROWS[2:6], "0.06;12;", "0.07;14;", ";16;64"]
    done = imported(rows, tmp_path, "--repair")
    assert done.exit_code == 0, done.exception
    (read,) = read_recording(tmp_path / "out")
    np.testing.assert_allclose(read.time, [0.02, 0.03, 0.04, 0.05])
    np.testing.assert_allclose(read.columns["x"]["torque"], [4.0, 6.0, 8.0, 10.0])
    np.testing.assert_allclose(read.columns["x"]["position"], [4.0, 9.0, 16.0, 25.0])
    assert json.loads((tmp_path / "out" / "recording.json").read_text())["repaired"] == {"leading_rows": 2, "trailing_rows": 3}
    assert "2 rows cut off before time 0.02 s, 3 rows cut off after time 0.05 s" in caplog.text


def test_an_optional_column_may_begin_late(tmp_path: Path) -> None:
    """Only a column that needs a number in every row decides what is cut off; a single missing sample is filled in first."""
    axis = "{torque: {column: M, unit: N·m}, position: {column: q, unit: rad}, temperature: {column: T, unit: degC}}"
    rows = ["0.00;;0;", "0.01;2;;", "0.02;4;4;", "0.03;6;9;20"]
    (tmp_path / "scope.csv").write_text("\n".join(["t;M;q;T", *rows]) + "\n")
    (tmp_path / "map.yaml").write_text(MAP.partition("axes:")[0] + f"axes:\n  x: {{columns: {axis}}}\n")
    read = import_recording(tmp_path / "scope.csv", read_map(tmp_path / "map.yaml"), mend=True)
    np.testing.assert_allclose(read.time, [0.01, 0.02, 0.03])
    np.testing.assert_allclose(read.columns["x"]["position"], [2.0, 4.0, 9.0])
    np.testing.assert_array_equal(read.columns["x"]["temperature"], [np.nan, np.nan, 20.0])
    assert read.extra()["repaired"] == {"x.position": 1, "leading_rows": 1}


def test_a_missing_sample_between_uneven_steps_lies_on_the_straight_line(tmp_path: Path) -> None:
    """At 0.04 s three quarters of the way from 0.01 to 0.05 s are gone; the file is resampled."""
    (tmp_path / "scope.csv").write_text("t;M;q\n0.00;0;0\n0.01;1;1\n0.04;;4\n0.05;5;5\n0.06;6;6\n")
    (tmp_path / "map.yaml").write_text(MAP + "resample: 0.01\n")
    read = import_recording(tmp_path / "scope.csv", read_map(tmp_path / "map.yaml"), mend=True)
    np.testing.assert_allclose(read.columns["x"]["torque"], 100.0 * read.time)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([*ROWS[:3], "0.03;;9", "0.04;;16", *ROWS[5:]], r"x.torque is nan at row 4"),
        (["0.00;inf;0", *ROWS[1:]], r"x.torque is inf at row 1"),
        ([f"{k * 0.01:.2f};;{k}" for k in range(8)], r"x.torque is nan at row 1"),
        (["0.00;;0", "0.01;;1", "0.02;4;", "0.03;6;"], r"x.torque is nan at row 1"),
        ([*ROWS[:3], "0.03;inf;9", *ROWS[4:]], r"x.torque is inf at row 4"),
        ([*ROWS[:4], "0.03;6;10", *ROWS[4:]], r"time falls or stands still at row 5"),
    ],
)
def test_what_nobody_can_know_is_refused(rows: list[str], message: str, tmp_path: Path) -> None:
    refused = imported(rows, tmp_path, "--repair")
    assert isinstance(refused.exception, UserError)
    assert message in str(refused.exception)
    assert "--repair" not in str(refused.exception)
    assert not (tmp_path / "out").exists()
