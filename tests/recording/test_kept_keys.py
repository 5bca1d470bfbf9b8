"""Keys outside the contract: what a person writes beside it is kept as JSON has it, or told by its name; RFC 8259, clause 6."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.recording.import_map import read_map
from drivetwin.recording.importer import import_recording
from drivetwin.recording.reader import read_recording
from drivetwin.recording.writer import write_recording

MAP = """\
machine: bench
time: {column: t, unit: s}
about: {%s}
axes:
  x: {columns: {torque: {column: M, unit: N·m}, position: {column: q, unit: rad}}, drive: {%s}}
"""


def imported(folder: Path, about: str = "", drive: str = "") -> dict[str, Any]:
    """recording.json of a table with a map that says so much beside the contract."""
    (folder / "scope.csv").write_text("t,M,q\n" + "".join(f"{0.01 * row:.2f},{row % 3},{row}\n" for row in range(60)))
    (folder / "map.yaml").write_text(MAP % (about, drive), encoding="utf-8")
    recording = import_recording(folder / "scope.csv", read_map(folder / "map.yaml"))
    write_recording(recording, folder / "out")
    told: dict[str, Any] = json.loads((folder / "out" / "recording.json").read_text(encoding="utf-8"))
    return told


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ("date: 2019-05-01", {"date": "2019-05-01"}),
        ("when: 2019-05-01 10:00:00", {"when": "2019-05-01T10:00:00"}),
        ("who: [a, {b: 2.5}, null, true]", {"who": ["a", {"b": 2.5}, None, True]}),
    ],
)
def test_what_is_said_about_a_recording_is_kept(said: str, kept: dict[str, object], tmp_path: Path) -> None:
    assert imported(tmp_path, about=said)["about"] == kept


@pytest.mark.parametrize(
    ("said", "refused"),
    [
        ("x: .nan", "about.x: nan is not a finite number"),
        ("x: {y: [1, .inf]}", "about.x: inf is not a finite number"),
        ("x: {3: 4}", "about.x: the key 3 is not text"),
        ("x: !!set {a, b}", "about.x: a set cannot be kept"),
        ("x: !!binary aGVsbG8=", "about.x: a bytes cannot be kept"),
    ],
)
def test_what_json_has_not_is_told(said: str, refused: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=re.escape(refused)):
        imported(tmp_path, about=said)


def test_a_constant_of_the_drive_that_the_contract_has_not_is_kept_where_it_is_a_number(tmp_path: Path) -> None:
    assert imported(tmp_path, drive="coulomb: 2.5")["axes"]["x"]["drive"]["coulomb"] == 2.5
    with pytest.raises(UserError, match=re.escape("axes.x.drive.coulomb: nan is not a finite number")):
        imported(tmp_path, drive="coulomb: .nan")


@pytest.mark.parametrize("place", ["", "axes.x", "axes.x.drive"])
def test_a_recording_with_a_constant_that_is_no_number_is_refused_by_its_key(place: str, tmp_path: Path) -> None:
    told = imported(tmp_path, drive="position_gain: 1.0")
    at = told
    for key in place.split(".") if place else ():
        at = at[key]
    at["coulomb"] = float("nan")
    (tmp_path / "out" / "recording.json").write_text(json.dumps(told))
    where = f"{place}.coulomb" if place else "coulomb"
    with pytest.raises(UserError, match=re.escape(f"recording.json: {where}: nan is not a finite number")):
        read_recording(tmp_path / "out")
