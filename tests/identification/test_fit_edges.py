"""`drivetwin fit` at the ends of what its options and recordings may be."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic
from typer import Typer
from typer.testing import CliRunner, Result

from drivetwin.cli.fit import fit_command
from drivetwin.foundation.errors import UserError
from drivetwin.identification import Settings, identify
from drivetwin.motion.filtering import reach
from drivetwin.motion.moving import widen
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_into


@pytest.fixture(scope="module")
def strokes() -> Recording:
    return synthetic.record(synthetic.strokes(), synthetic.PLAIN, np.random.default_rng(1))


def fit(recording: Recording, folder: Path, *options: str) -> Result:
    (folder / "model.xml").write_text(synthetic.TURNTABLE)
    write_into(recording, folder / "run")
    app = Typer()
    app.command()(fit_command)
    return CliRunner().invoke(app, [str(folder / "model.xml"), str(folder / "run"), "--out", str(folder / "out"), *options])


def without(recording: Recording, *rows: slice) -> Recording:
    """The recording with these rows lost."""
    kept = np.ones(len(recording.time), dtype=np.bool_)
    for lost in rows:
        kept[lost] = False
    columns = {axis: {name: values[kept] for name, values in named.items()} for axis, named in recording.columns.items()}
    return replace(recording, time=recording.time[kept], columns=columns)


@pytest.mark.parametrize("width", [0, 1, 3, 9, 10, 11, 10**400])
def test_widening_is_what_it_says(width: int) -> None:
    mask = np.zeros(10, dtype=np.bool_)
    mask[[2, 9]] = True
    near = [any(abs(index - other) <= width for other in (2, 9)) for index in range(10)]
    assert widen(mask, width).tolist() == near


@pytest.mark.parametrize("margin", [1000.0, 1e308])
def test_a_reversal_margin_beyond_all_motion(margin: float, strokes: Recording) -> None:
    with pytest.raises(UserError, match=re.escape(f"--reversal-margin {margin:g}: all motion in strokes")) as refused:
        identify(synthetic.turntable(), [strokes], settings=Settings(reversal_margin=margin))
    assert "standstill" not in str(refused.value)


def test_pieces_too_short_for_the_filter_are_left_out(strokes: Recording, tmp_path: Path) -> None:
    done = fit(without(strokes, slice(3, 6)), tmp_path, "--allow-gaps")
    assert done.exit_code == 0, done.exception
    assert (tmp_path / "out" / "identified.json").is_file()


def test_where_every_piece_is_too_short(strokes: Recording, tmp_path: Path) -> None:
    refused = fit(without(strokes, *(slice(start, start + 3) for start in range(20, 20000, 40))), tmp_path, "--allow-gaps")
    assert isinstance(refused.exception, UserError)
    assert "pieces between gaps is long enough for the filter" in str(refused.exception)


def test_a_recording_without_torque_cannot_be_fitted(strokes: Recording, tmp_path: Path) -> None:
    position = strokes.columns["turn"]["position"]
    refused = fit(replace(strokes, columns={"turn": {"position": position, "position_demand": position}}), tmp_path)
    assert isinstance(refused.exception, UserError)
    assert "turn.torque is missing (from row 1 on), which drivetwin fit needs" in str(refused.exception)


def test_a_filter_that_reaches_beyond_any_recording(strokes: Recording, tmp_path: Path) -> None:
    assert reach(1e-3, 1e-9) > 10**9
    refused = fit(strokes, tmp_path, "--cutoff", "1e-9")
    assert isinstance(refused.exception, UserError)
    assert "record longer or raise the cut-off" in str(refused.exception)
