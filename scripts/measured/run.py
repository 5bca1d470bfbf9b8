"""Runs `drivetwin diagnose` on a case as a user would, in a process of its own, and keeps how it ended."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import write_json
from measured.cases import Case

DRIVETWIN = (sys.executable, "-c", "from drivetwin.cli import main; main()")
SCHEMA = "measured-outcome/1"
REFUSED = 2
"""Exit status of an input that is refused, with one line that says why."""


class Status(StrEnum):
    """How a case ended."""

    ANSWERED = "answered"
    REFUSED = "refused"
    CRASHED = "crashed"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class Outcome:
    """How a case ended by which code (its hash): the last line on stderr of one without an answer, and how long it took [s]."""

    status: Status
    line: str
    seconds: float
    code: str


NOT_RUN = Outcome(Status.NOT_RUN, "", 0.0, "")


@dataclass(frozen=True)
class Place:
    """Where everything of a run stands."""

    out: Path

    @property
    def inputs(self) -> Path:
        """Recordings that were imported."""
        return self.out / "inputs"

    def case(self, name: str) -> Path:
        """How a case ended and what it printed."""
        return self.out / "cases" / name

    def diagnosis(self, name: str) -> Path:
        """What the diagnosis wrote."""
        return self.case(name) / "diagnosis"

    def outcome(self, name: str, code: str) -> Outcome:
        """How a case ended by this code; NOT_RUN where it was not asked."""
        file = self.case(name) / "outcome.json"
        if not file.is_file():
            return NOT_RUN
        told = json.loads(file.read_text(encoding="utf-8"))
        if told["code"] != code:
            return NOT_RUN
        return Outcome(Status(told["status"]), told["line"], told["seconds"], told["code"])


def import_inputs(case: Case, place: Place, code: str, limit: float, drivetwin: Sequence[str] = DRIVETWIN) -> None:
    """Import the recordings of a case that come as a drive's export, once by each code. Raises UserError where that fails."""
    kept = place.case(case.name) / "imported.txt"
    if not case.imports or (kept.is_file() and kept.read_text(encoding="utf-8") == code):
        return
    for each in case.imports:
        words = ["import", *_words(each.files), "--map", str(each.map), "--out", str(each.to)]
        status, line = _run([*drivetwin, *words], place.case(case.name), limit)
        if status is not Status.ANSWERED:
            raise UserError(f"{case.name}: {each.files[0]} cannot be imported by {each.map}: {line}")
    kept.write_text(code, encoding="utf-8")


def run_case(case: Case, place: Place, code: str, limit: float, drivetwin: Sequence[str] = DRIVETWIN) -> Outcome:
    """Diagnose, by the command `drivetwin`, for at most `limit` [s]; the outcome is kept."""
    kept = place.case(case.name) / "outcome.json"
    kept.unlink(missing_ok=True)
    words = ["diagnose", str(case.model), *_words(case.training), "--validate", *_words(case.validation)]
    began = time.monotonic()
    status, line = _run([*drivetwin, *words, "--out", str(place.diagnosis(case.name))], place.case(case.name), limit)
    outcome = Outcome(status, line, time.monotonic() - began, code)
    write_json(kept, {"schema": SCHEMA, **asdict(outcome)})
    return outcome


def _words(paths: Sequence[Path]) -> list[str]:
    return [str(path) for path in paths]


def _run(command: Sequence[str], folder: Path, limit: float) -> tuple[Status, str]:
    """Run a command; what it prints goes to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "command.txt").write_text(shlex.join(command) + "\n", encoding="utf-8")
    with (folder / "stdout.txt").open("wb") as out, (folder / "stderr.txt").open("wb") as err:
        try:
            status = subprocess.run(command, stdout=out, stderr=err, check=False, timeout=limit).returncode
        except subprocess.TimeoutExpired:
            return Status.CRASHED, f"no answer after {limit:g} s"
    if status == 0:
        return Status.ANSWERED, ""
    printed = (folder / "stderr.txt").read_text(encoding="utf-8", errors="replace").strip()
    refused = status == REFUSED and "Traceback" not in printed
    return (Status.REFUSED if refused else Status.CRASHED), _telling(printed) or f"exit status {status}, nothing on stderr"


def _telling(printed: str) -> str:
    """The line that says what happened: the exception's where there is a traceback, else the last."""
    lines = printed.splitlines()
    raised = [line for line in lines if re.match(r"[\w.]+(Error|Exception|Interrupt|Exit)\b", line)]
    return raised[-1] if raised else (lines or [""])[-1]
