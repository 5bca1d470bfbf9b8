"""One cell of the table: the verdict on a mutant in a case; kept on disk, so that a run resumes where it ended."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import INSTALLED, write_json
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.run import run_one
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.verdict import CaseResult
from drivetwin.mutants.library import mutant_file

FORMAT = "mutant-cell/1"

REFERENCE = "reference"
"""The name of the controller that is not broken."""

CONTROLLER = "drivetwin.controller"
"""The module that runs it."""

WHAT_MATTERS = (
    *("bus", "controller", "drive_profiles", "emulator", "foundation"),
    *("hil_tests", "identification", "motion", "recording"),
)
"""Packages whose content decides on a verdict."""


@dataclass(frozen=True)
class Cell:
    """`outcome` is accepted, rejected or skipped; `failed` are the expectations that rejected, each once; `said` the first
    failure in words."""

    mutant: str
    case: str
    outcome: str
    failed: tuple[str, ...]
    said: str


@dataclass(frozen=True)
class Field:
    """A field that is to be filled: a mutant (or `reference`) in a case. With `evidence` bus log and truth are kept."""

    mutant: str
    scenario: Scenario
    evidence: bool


def fill(bench: Bench, field: Field, out: Path) -> Cell:
    """The verdict of a field, of disk where nothing that matters has changed since; else the case is run.

    Everything goes to `out`/MUTANT/NN_group.name. Raises UserError as `run_one`.
    """
    folder = out / field.mutant / field.scenario.identity
    state = _state_of(bench, field.mutant)
    known = _read(folder / "cell.json", state)
    if known is not None:
        return known
    shutil.rmtree(folder, ignore_errors=True)  # a case that is skipped would leave what was there
    result = run_one(broken_bench(bench, field.mutant), field.scenario, folder)
    if not field.evidence and folder.is_dir():
        _keep_verdict_only(folder)
    cell = _cell(field, result)
    write_json(folder / "cell.json", {"format": FORMAT, "state": state, **asdict(cell)})
    return cell


def broken_bench(bench: Bench, name: str) -> Bench:
    """The bench with a mutant in the place of its controller. Raises UserError where that is not the reference controller."""
    if name == REFERENCE:
        return bench
    command = bench.controller.command
    if CONTROLLER not in command:
        raise UserError(f"{bench.path}: controller.command: expected the reference controller (-m {CONTROLLER}), to break it")
    place = command.index(CONTROLLER)
    broken = [*command[:place], "drivetwin.mutants", name, *command[place + 1 :]]
    return bench.model_copy(update={"controller": bench.controller.model_copy(update={"name": name, "command": broken})})


def _cell(field: Field, result: CaseResult) -> Cell:
    failed = tuple(dict.fromkeys(failure.expectation for failure in result.failures))
    said = result.failures[0].message if result.failures else ""
    return Cell(field.mutant, field.scenario.identity, result.outcome.value, failed, said)


def _read(path: Path, state: str) -> Cell | None:
    """A cell of an earlier run of the same code on the same bench; None where there is none."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    if told.get("format") != FORMAT or told.get("state") != state:
        return None
    return Cell(told["mutant"], told["case"], told["outcome"], tuple(told["failed"]), told["said"])


def _keep_verdict_only(folder: Path) -> None:
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        elif path.name not in ("verdict.json", "controller.log"):
            path.unlink()


def _state_of(bench: Bench, name: str) -> str:
    """sha256 over all that decides on the verdicts of a mutant on a bench."""
    own = (INSTALLED / "mutants" / "surgery.py", mutant_file(name).resolve()) if name != REFERENCE else ()
    return _digest((*_sources(), *own, bench.path, bench.effects_path))


@cache
def _sources() -> Sequence[Path]:
    """Code and data of the packages that matter."""
    found = (path for package in WHAT_MATTERS for path in (INSTALLED / package).rglob("*"))
    return tuple(sorted(path for path in found if path.is_file() and path.suffix in (".py", ".yaml", ".xml", ".csv")))


def _digest(paths: Iterable[Path]) -> str:
    found = hashlib.sha256()
    for path in paths:
        found.update(f"{os.path.relpath(path, INSTALLED)}\n".encode())  # a bench may be anywhere
        found.update(path.read_bytes())
    return found.hexdigest()
