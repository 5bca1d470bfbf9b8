"""Blind cases that are asked with a signal and without it: what their commands have in common."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Iterable
from pathlib import Path

from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import Recording


def recordings_of(folder: Path, kind: str) -> list[Recording]:
    """Of a case, those to train or to validate on."""
    return [part for path in sorted(folder.glob(f"{kind}_*")) for part in read_recording(path)]


def first_cause(found: Diagnosis) -> str:
    """The first cause of a diagnosis as effect@axis."""
    return f"{found.causes[0].effect}@{found.causes[0].axis}" if found.causes else "none"


def no_progress(_: str, __: float) -> None:
    """A line a case is progress enough."""


def write_or_ask(described: str | None, ways: Iterable[str]) -> ArgumentParser:
    """The options of both commands."""
    parser = ArgumentParser(description=described)
    parser.add_argument("what", choices=("write", "ask"))
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--family", action="append", default=[], help="as of drivetwin blind")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--way", action="append", choices=tuple(ways), help="to ask; both unless told")
    return parser
