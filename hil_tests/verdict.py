"""The verdict of a case: accepted, rejected or skipped; which requirement failed, when, on which axis, by how much."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path


class Outcome(StrEnum):
    """What became of a case."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class Failure:
    """One requirement that was not met.

    `time` is simulated time since power on [s]; `measured` and `limit` are in `unit`; None where the requirement has none.
    """

    expectation: str
    message: str
    axis: str | None = None
    time: float | None = None
    measured: float | None = None
    limit: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class Measured:
    """One quantity of a case, the less the better, whether it met its limit or not.

    `noise` is its standard deviation from run to run where the sensors' noise alone differs, None where that is not known.
    """

    name: str
    value: float
    unit: str
    axis: str | None = None
    limit: float | None = None
    noise: float | None = None


@dataclass(frozen=True)
class CaseResult:
    """A case and its verdict.

    `number` is that of the group as the machine comes alive (1 boot, ... 11 soak), `name` that of the scenario's file.
    `skipped_because` says why where the outcome is skipped; `not_judged` are expectations that only the plant's truth can
    answer, where drives are real. `tries` counts the runs in real time that the stand itself spoilt, and the last one.
    `wall` [s] is not a part of what is compared from run to run.
    """

    number: int
    group: str
    name: str
    title: str
    requirement: str
    outcome: Outcome
    failures: tuple[Failure, ...]
    measured: tuple[Measured, ...]
    skipped_because: str
    simulated: float
    wall: float
    folder: Path | None
    not_judged: tuple[str, ...] = ()
    tries: int = 1
