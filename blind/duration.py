"""How long the work on a case took: kept apart from the score, which is the same however long it takes."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from drivetwin.foundation.files import write_json

SCHEMA = "blind-times/1"


@dataclass(frozen=True)
class Seconds:
    """Wall-clock time of one outcome [s]; the recording is shared by the outcomes of a case."""

    record: float
    diagnose: float


@dataclass(frozen=True)
class Duration:
    """How long one diagnosis of one case took, and the recording for it."""

    case: int
    machine: str
    nominal: str
    seconds: Seconds


def write_seconds(path: Path, seconds: Seconds) -> None:
    """Beside what was answered."""
    write_json(path, asdict(seconds))


def read_seconds(path: Path) -> Seconds:
    """As `write_seconds` wrote it."""
    return Seconds(**json.loads(path.read_text(encoding="utf-8")))


def write_times(path: Path, durations: Iterable[Duration]) -> None:
    """The times of a whole run."""
    write_json(path, {"schema": SCHEMA, "durations": [asdict(duration) for duration in durations]})
