"""What the score reads of a report.json, by contract gap-report/2 and by none of the code that wrote it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivetwin.foundation.errors import UserError
from measured.motion import Band

SCHEMA = "gap-report/2"
UNKNOWN = "unknown"


@dataclass(frozen=True)
class Cause:
    """One entry of `causes`."""

    effect: str
    axis: str
    probability: float
    share: float | None


@dataclass(frozen=True)
class AxisGap:
    """Gap of one axis on validation [N·m or N], rms, without and with the selected effects."""

    band: Band
    before: float
    after: float


@dataclass(frozen=True)
class Gap:
    """A report."""

    verdict: str
    settings: Mapping[str, Any]
    axes: Mapping[str, AxisGap]
    causes: tuple[Cause, ...]
    selected: tuple[tuple[str, str], ...]


def read_gap(file: Path) -> Gap:
    """Raises UserError naming what the file lacks."""
    try:
        told = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(f"no file {file}; a diagnosis that exits with 0 writes report.json") from None
    except ValueError as error:
        raise UserError(f"{file} is no JSON: {error}") from None
    if told.get("schema") != SCHEMA:
        raise UserError(f"{file} is {told.get('schema')}; {SCHEMA} is what is scored")
    try:
        return Gap(
            verdict=told["verdict"],
            settings=told["settings"],
            axes={name: _axis(each, told["after"][name]) for name, each in told["axes"].items()},
            causes=tuple(_cause(one) for one in told["causes"]),
            selected=tuple((one["effect"], one["axis"]) for one in told["selected"]),
        )
    except KeyError as error:
        raise UserError(f"{file} lacks the key {error} of {SCHEMA}") from None
    except TypeError as error:
        raise UserError(f"{file} is not as {SCHEMA} says: {error}") from None


def _cause(told: Mapping[str, Any]) -> Cause:
    share = told.get("share")
    return Cause(told["effect"], told["axis"], float(told["probability"]), None if share is None else float(share))


def _axis(told: Mapping[str, Any], after: Mapping[str, Any]) -> AxisGap:
    band = Band(float(told["cutoff_hz"]), float(told["standstill_velocity"]))
    return AxisGap(band, float(told["gap_rms"]), float(after["gap_rms"]))
