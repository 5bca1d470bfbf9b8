"""`drivetwin bode` on several axes: one that tells nothing is named, and costs the others nothing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer

from drivetwin.cli.bode import bode_command
from drivetwin.controller import commissioning
from drivetwin.controller.commissioning import Commissioned, commission
from drivetwin.controller.session import Session
from drivetwin.foundation.errors import UserError
from drivetwin.identification.frequency.result import AxisResponse


@dataclass(frozen=True)
class Mute(Commissioned):
    """An axis whose lines drown in noise."""

    def evaluate(self) -> AxisResponse:
        raise UserError("axis rotate: 2 of 110 frequencies are reliable")


SHORTER = {"PERIODS": 3, "STROKES": 2, "STEPS": 2, "CURVE_LEVELS": (0.5, 1.0)}
"""A measurement that takes a third of the time."""


@pytest.fixture
def rotate_is_mute(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each axis is measured, in less time; what was measured of rotate is no use."""
    for name, value in SHORTER.items():
        monkeypatch.setattr(commissioning, name, value)

    def measured(session: Session, axis: str, seed: int) -> Commissioned:
        found = commission(session, axis, seed)
        return Mute(**vars(found)) if axis == "rotate" else found

    monkeypatch.setattr(commissioning, "commission", measured)


@pytest.mark.usefixtures("rotate_is_mute")
def test_what_succeeded_is_written_and_what_failed_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "bode"
    with pytest.raises(typer.Exit) as ended:
        bode_command(machine="scara", axis=["rotate", "lift"], out=out, quiet=True)
    assert ended.value.exit_code == 1
    assert capsys.readouterr().err == "drivetwin: axis rotate: 2 of 110 frequencies are reliable\n"
    told = json.loads((out / "bode.json").read_text(encoding="utf-8"))
    assert list(told["axes"]) == ["lift"]
    assert told["failed"] == {"rotate": "axis rotate: 2 of 110 frequencies are reliable"}
    assert (out / "recordings" / "frequency_response_rotate").is_dir()
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Axis lift" in page
    assert "axis rotate: 2 of 110 frequencies" in page


@pytest.mark.usefixtures("rotate_is_mute")
def test_where_no_axis_tells_anything_nothing_is_written(tmp_path: Path) -> None:
    out = tmp_path / "bode"
    with pytest.raises(UserError, match="axis rotate: 2 of 110 frequencies"):
        bode_command(machine="scara", axis=["rotate"], out=out, quiet=True)
    assert not out.exists()


def test_an_axis_that_there_is_not_is_refused_before_anything_moves(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="machine scara has no axis 'hook', only lift, rotate, stretch"):
        bode_command(machine="scara", axis=["hook"], out=tmp_path / "bode")
