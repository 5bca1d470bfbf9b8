"""`drivetwin diagnose` as a user runs it: files, exit status, one line for what it refuses."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from in_process import Command
from processes import Ended
from turntable import MODEL, turntable

from drivetwin.cli.diagnose import FailOn
from drivetwin.cli.many_values import repeated
from drivetwin.diagnosis.report.schema import read_report
from drivetwin.emulator.effects import read_effects


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    turntable(tmp_path)
    return tmp_path


def test_a_report_a_patch_and_predictions_the_same_bytes_twice(bench: Path, command: Command) -> None:
    """The machine of these recordings differs by its Coulomb friction alone: a gap, and an explained one. A program reads JSON,
    and a build fails on any gap or on an unexplained one."""
    line = "diagnose model.xml fitted --validate one two --out out"
    outcome = command(f"{line} --json --fail-on gap")
    first_time = files_in(bench / "out")
    assert (outcome.status, outcome.err) == (1, "")
    assert outcome.out.encode() == first_time["report.json"]
    assert json.loads(outcome.out)["verdict"] == "explained"
    outcome = command(f"{line} --fail-on unexplained")
    made = files_in(bench / "out")
    assert made == first_time
    assert (outcome.status, outcome.err) == (0, "")
    assert "The gap is explained" in outcome.out
    assert "the validation recordings" in outcome.out
    predicted = ["prediction/one.parquet", "prediction/two.parquet"]
    assert sorted(made) == [".drivetwin", "effects.json", "patched.xml", *predicted, "report.html", "report.json"]
    assert len(made["report.html"]) < 1_500_000
    report = read_report(bench / "out" / "report.json")
    first = report.causes[0]
    assert (first.effect, first.axis) == ("coulomb", "rotate")
    assert first.parameters["coulomb"].value == pytest.approx(0.8, abs=0.01)
    assert list(report.inputs) == [
        "model.xml",
        *(f"{name}/{file}" for name in ("fitted", "one", "two") for file in ("recording.json", "signals.parquet")),
    ]
    assert report.inputs["model.xml"] == hashlib.sha256(MODEL.encode()).hexdigest()
    assert [(placed.effect.name, placed.axis) for placed in read_effects(bench / "out" / "effects.json")] == [
        (each.effect, each.axis) for each in report.selected
    ]
    table = pa.concat_tables([pq.read_table(bench / "out" / name) for name in predicted])
    columns = {name.removeprefix("rotate."): table[name].to_numpy() for name in table.column_names}
    for when, told in (("before", report.axes["rotate"].gap_rms), ("after", report.after["rotate"].gap_rms)):
        gap = (columns["torque_measured"] - columns[f"torque_{when}"])[columns["used"]]
        assert told == pytest.approx(np.sqrt(np.mean(gap**2)), rel=1e-12)


def files_in(folder: Path) -> dict[str, bytes]:
    """Each file's content by its path below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("verdict", "gap", "unexplained"),
    [("no_gap", False, False), ("explained", True, False), ("partly_explained", True, False), ("unexplained", True, True)],
)
def test_which_verdicts_fail_a_build(verdict: str, gap: bool, unexplained: bool) -> None:
    assert (FailOn.GAP.fails(verdict), FailOn.UNEXPLAINED.fails(verdict)) == (gap, unexplained)


def test_without_validation_blocks_are_held_back_and_it_says_so(bench: Path, command: Command) -> None:
    outcome = command("diagnose model.xml fitted --out out --no-html --seed 4")
    assert outcome.status == 0
    assert "blocks held back from the recordings" in outcome.out
    assert not (bench / "out" / "report.html").exists()
    assert read_report(bench / "out" / "report.json").seed == 4
    assert (bench / "out" / "prediction" / "fitted.parquet").is_file()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("diagnose nowhere.xml fitted --out out", "no model at nowhere.xml"),
        ("diagnose model.xml nowhere --out out", "nowhere is not a folder"),
        ("diagnose model.xml fitted --validate fitted --out out", "fitted (--validate) has the same samples as fitted (REC"),
        ("diagnose model.xml fitted --validate one fitted --out out", "fitted (--validate) has the same samples as fitted"),
        ("diagnose model.xml fitted --cutoff -3 --out out", "--cutoff -3: expected a frequency of 1 Hz or more"),
        ("diagnose model.xml fitted --cutoff nan --out out", "--cutoff nan: expected a frequency"),
        ("diagnose model.xml fitted --seed -1 --out out", "'--seed'"),
        ("diagnose model.xml fitted --out model.xml", "model.xml is a file; --out names the directory to write"),
        ("diagnose model.xml fitted --out one", "holds files that drivetwin did not write"),
        ("diagnose model.xml fitted --out fitted", "fitted/recording.json is read, and --out fitted would replace"),
        ("diagnose model.xml fitted --validate two --out two", "two/recording.json is read, and --out two would replace"),
        ("diagnose model.xml fitted", "Missing option '--out'"),
        ("diagnose model.xml --out out", "Missing argument 'RECORDING...'"),
    ],
)
def test_one_line_and_nothing_written(bench: Path, command: Command, line: str, expected: str) -> None:
    (bench / "one" / ".drivetwin").unlink()
    before = sorted(bench.rglob("*"))
    outcome = command(line)
    assert outcome.status == 2
    assert outcome.err.startswith("drivetwin: ")
    assert expected in outcome.err
    assert outcome.err.count("\n") == 1
    assert outcome.out == ""
    assert sorted(bench.rglob("*")) == before


def test_a_gap_in_time_is_refused_or_split(bench: Path, command: Command) -> None:
    signals = bench / "fitted" / "signals.parquet"
    rows = pq.read_table(signals)
    keep = np.ones(rows.num_rows, dtype=np.bool_)
    keep[9_000:9_050] = False
    pq.write_table(rows.filter(keep), signals)
    refused = command("diagnose model.xml fitted --validate one --out out --no-html")
    assert refused.status == 2
    assert "column time has a gap" in refused.err
    assert "--allow-gaps" in refused.err
    assert command("diagnose model.xml fitted --validate one --out out --no-html --allow-gaps --quiet") == Ended(0, "", "")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("m r1 r2 --validate a --out o", "m r1 r2 --validate a --out o"),
        ("m r --validate a b c --out o", "m r --validate a --validate b --validate c --out o"),
        ("m r --validate=a b --out o", "m r --validate=a --validate b --out o"),
        ("m r --out o --validate a b", "m r --out o --validate a --validate b"),
        ("m r --validate a b --validate c --out o", "m r --validate a --validate b --validate c --out o"),
        ("m r --out o", "m r --out o"),
    ],
)
def test_all_up_to_the_next_option_are_to_validate(line: str, expected: str) -> None:
    assert list(repeated("--validate", line.split())) == expected.split()
