"""`python -m measured` from its words to its files, with a command that stands for drivetwin."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import measured.__main__
import pytest
from measured.__main__ import main
from measured.table import BEGIN, END
from measured_bench import MODEL, rigid, swing, write_recording
from stub_drivetwin import ASKED

STUB = (sys.executable, str(Path(__file__).with_name("stub_drivetwin.py")))
THIS_CODE = "this code"
SEEDED, CONTROL = "laas_inertia_seeded", "laas_no_gap"
"""Two of the cases that there are, made by formula here."""
SPEEDS = (2, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 120, 140, 160, 180, 200)


@dataclass(frozen=True)
class Bench:
    """Folders of data, and of one run over them."""

    data: Path
    out: Path

    def behave(self, case: str, how: str) -> None:
        """What the diagnosis of a case does."""
        (self.data / "measured" / case / "behaviour.txt").write_text(how, encoding="utf-8")

    def run(self, *words: str) -> int:
        """The exit status."""
        return main(["--data", str(self.data), "--out", str(self.out), *words], STUB)

    @property
    def score(self) -> dict[str, Any]:
        """score.json."""
        told: dict[str, Any] = json.loads((self.out / "score.json").read_text(encoding="utf-8"))
        return told

    def asked(self, case: str) -> int:
        """How many times a case was diagnosed."""
        file = self.out / "cases" / case / ASKED
        return len(file.read_text(encoding="utf-8").splitlines()) if file.is_file() else 0


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Two cases beside the two that are imported, every one answered once by "this code"; not to be written to."""
    folder = tmp_path_factory.mktemp("measured")
    _write_data(folder / "data")
    made = Bench(folder / "data", folder / "out")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measured.__main__, "code_hash", lambda: THIS_CODE)
        assert made.run() == 0
    return made


@pytest.fixture
def bench(answered: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    """The same, to go on with."""
    monkeypatch.setattr(measured.__main__, "code_hash", lambda: THIS_CODE)
    shutil.copytree(answered.data, tmp_path / "data")
    shutil.copytree(answered.out, tmp_path / "out")
    return Bench(tmp_path / "data", tmp_path / "out")


def _write_data(data: Path) -> None:
    labels = {
        SEEDED: {"effects": [{"effect": "inertia", "axis": "motor"}], "also": ["payload"], "must_not": ["stribeck"]},
        CONTROL: {"effects": [], "also": [], "must_not": ["inertia"]},
    }
    for name in labels:
        for kind in ("train_00", "validate"):
            time, position, velocity, acceleration = swing(2.0)
            write_recording(data / "measured" / name / kind, time, position, rigid(velocity, acceleration) + 0.1 * acceleration)
        (data / "measured" / name / "nominal.xml").write_text(MODEL, encoding="utf-8")
    (data / "measured" / "labels.json").write_text(json.dumps(labels), encoding="utf-8")
    screw, emps = data / "epos_screw_drive_1" / "steady_state" / "0.096kg", data / "emps"
    files = [screw / f"{sign}{speed}.csv" for sign in ("", "n") for speed in SPEEDS]
    for file in (*files, emps / "DATA_EMPS.mat", emps / "DATA_EMPS_PULSES.mat"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()


def test_every_case_is_answered_and_scored(answered: Bench) -> None:
    told = answered.score
    assert told["schema"] == "measured-score/1"
    assert list(told["cases"]) == [SEEDED, CONTROL, "emps", "epos_screw"]
    assert told["counts"]["right first answer"] == {"count": 1, "of": 4}
    assert told["cases"][SEEDED]["strict"] is True
    assert told["cases"][SEEDED]["closed"] == pytest.approx(0.75)
    assert told["cases"][CONTROL]["must_not"] == ["inertia 0.95"]
    assert told["settings"] == {"seed": 0}


def test_training_and_validation_are_given_as_the_labels_say(answered: Bench) -> None:
    given = {name: (answered.out / "cases" / name / ASKED).read_text(encoding="utf-8") for name in answered.score["cases"]}
    assert given == {SEEDED: "1 1\n", CONTROL: "1 1\n", "emps": "1 1\n", "epos_screw": "24 8\n"}
    typed = (answered.out / "cases" / "emps" / "command.txt").read_text(encoding="utf-8")
    assert "docs/examples/emps/model.xml" in typed
    assert "labels" not in typed


def test_the_page_is_one_file_that_links_to_the_reports(answered: Bench) -> None:
    page = (answered.out / "score.html").read_text(encoding="utf-8")
    link = f"cases/{SEEDED}/diagnosis/report.html"
    assert f'href="{link}"' in page
    assert (answered.out / link).is_file()
    assert "right first answer 1 of 4" in page
    body = page.partition("</head>")[2]
    assert 'src="http' not in body
    assert body.index("<table>") < body.index("plotly-graph-div")


def test_a_refusal_is_told_with_its_line_and_is_no_crash(bench: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    bench.behave(CONTROL, "refuse")
    assert bench.run("--only", CONTROL) == 0
    found = bench.score["cases"][CONTROL]
    assert (found["status"], found["line"]) == ("refused", "drivetwin: one direction only: record the other")
    assert found["reference"]["closed"] > 0.9  # the reference is told all the same
    assert "right first answer 1 of 4 (strict 1); refused 1" in capsys.readouterr().out
    assert f'href="cases/{CONTROL}/diagnosis' not in (bench.out / "score.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("behaviour", "line"), [("crash", "ValueError: a bug"), ("hang", "no answer after 5 s")])
def test_a_crash_exits_with_1_and_says_what_was_raised(bench: Bench, behaviour: str, line: str) -> None:
    bench.behave(SEEDED, behaviour)
    assert bench.run("--only", SEEDED, "--limit", "5") == 1
    found = bench.score["cases"][SEEDED]
    assert (found["status"], found["line"]) == ("crashed", line)


def test_an_exit_status_of_0_without_a_report_is_a_crash(bench: Bench) -> None:
    (bench.out / "cases" / SEEDED / "diagnosis" / "report.json").write_text('{"schema": "gap-report/1"}', encoding="utf-8")
    assert bench.run() == 1
    assert "gap-report/2 is what is scored" in bench.score["cases"][SEEDED]["line"]


def test_what_is_answered_is_not_asked_again_unless_by_only_or_other_code(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.run()
    assert (bench.asked(SEEDED), bench.asked("emps")) == (1, 1)
    bench.run("--only", SEEDED)
    assert (bench.asked(SEEDED), bench.asked("emps")) == (2, 1)
    assert bench.score["counts"]["answered"] == {"count": 4, "of": 4}
    monkeypatch.setattr(measured.__main__, "code_hash", lambda: "other code")
    bench.run("--only", SEEDED)
    assert bench.score["counts"]["not run"] == {"count": 3, "of": 4}
    assert bench.score["cases"]["emps"]["right"] is False


def test_the_table_goes_between_its_markers(bench: Bench, tmp_path: Path) -> None:
    file = tmp_path / "measured.md"
    file.write_text(f"# Before\n\n{BEGIN}\nold\n{END}\n\nAfter\n", encoding="utf-8")
    bench.run("--table", str(file))
    text = file.read_text(encoding="utf-8")
    assert text.startswith(f"# Before\n\n{BEGIN}\nRight first answer 1 of 4 (strict 1).\n\n| case |")
    assert text.endswith(f"\n{END}\n\nAfter\n")
    assert f"| {SEEDED} | bench | inertia | inertia | 0.95 | 80 % | strict |" in text
    assert "old" not in text


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--only", "emsp"], "--only emsp is no case; there are"),
        (["--data", "nowhere"], "--data is the folder that holds measured/labels.json"),
        (["--table", "nowhere.md"], "--table names a Markdown file with"),
    ],
)
def test_what_cannot_be_used_is_one_line_and_2(
    bench: Bench, words: list[str], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert bench.run(*words) == 2
    printed = capsys.readouterr().err
    assert line in printed
    assert printed.count("\n") == 1


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "Example: python -m measured --data ../shared/data --out out/measured" in capsys.readouterr().out
