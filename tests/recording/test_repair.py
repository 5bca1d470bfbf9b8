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


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([*ROWS[:3], "0.03;;9", "0.04;;16", *ROWS[5:]], r"x.torque is nan at row 4"),
        (["0.00;;0", *ROWS[1:]], r"x.torque is nan at row 1"),
        ([*ROWS[:3], "0.03;inf;9", *ROWS[4:]], r"x.torque is inf at row 4"),
        ([*ROWS[:4], "0.03;6;10", *ROWS[4:]], r"time falls or stands still at row 5"),
    ],
)
def test_what_nobody_can_know_is_refused(rows: list[str], message: str, tmp_path: Path) -> None:
    refused = imported(rows, tmp_path, "--repair")
    assert isinstance(refused.exception, UserError)
    assert message in str(refused.exception)
    assert not (tmp_path / "out").exists()
