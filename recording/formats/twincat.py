"""TwinCAT Scope exports as text: a block of rows about the file, one about each channel, then times and values in pairs.

As of TwinCAT 3 Scope View (Beckhoff TE13xx, "Export in csv"): channels have time columns of their own, or share them with the
channels of the same sample time to their right; times are milliseconds since the start, or Windows file times.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import ClassVar

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats.channels import Channel, on_one_time
from drivetwin.recording.formats.table_format import TableFormat
from drivetwin.recording.formats.text import Decimal, Spelling, decoded, is_number, number
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.recording import Samples
from drivetwin.recording.table import Table
from drivetwin.recording.units import canonical

NAME, UNIT = "Name", "Unit"
"""First cells of the rows that name the channels and their units; the first row of the file begins with `Name` as well."""
STARTS = ("Starttime of export", "StartRecord", "StartTime")
"""First cells of the row that holds the start as a file time, by version."""
HEAD = 4096
"""Bytes at most up to that row."""
END = "EOF"
TICKS = 1e7
"""Of a Windows file time in a second; it counts from 1601."""
FULL = 1e15
"""Below every file time of this century, and above every number of milliseconds: times are written as one or the other."""
ZERO = datetime(1601, 1, 1, tzinfo=UTC)

Row = list[str]


class TwinCat(TableFormat):
    """TwinCAT Scope exports; column 1 is `time`, common to all, and each other one a channel."""

    name: ClassVar[str] = "twincat"
    endings: ClassVar[tuple[str, ...]] = (".csv", ".txt")

    @classmethod
    def recognises(cls, file: Path) -> bool:
        """By its first cell and the start of the export."""
        with file.open("rb") as stream:
            head = stream.read(HEAD).decode("utf-8", errors="replace").lstrip("\ufeff")
        return head.startswith(NAME) and any(start in head for start in STARTS)

    def table(self, file: Path, import_map: ImportMap) -> Table:
        start, channels = read_twincat(file, import_map.csv.encoding)
        return on_one_time(file, start, channels, import_map)


def read_twincat(file: Path, encoding: str | None = None) -> tuple[datetime, list[Channel]]:
    """When the time of an export starts, and its channels.

    Raises UserError naming the file, and row and column where there is one, for what is no such export.
    """
    export = _Export.of(file, encoding)
    return export.start(), export.channels()


@dataclass(frozen=True)
class _Export:
    """The cells of a file. `head`: rows about each channel; `body`: rows of numbers, from line `first` on, counted from 1."""

    file: Path
    about: Sequence[Row]
    head: Sequence[Row]
    body: Sequence[Row]
    first: int

    @classmethod
    def of(cls, file: Path, encoding: str | None) -> _Export:
        lines = decoded(file, encoding).splitlines()
        delimiter = _delimiter(file, lines)
        rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter)]
        names = [at for at, row in enumerate(rows) if row[:1] == [NAME]]
        if len(names) < 2:
            raise UserError(f"{file}: no row {NAME!r} that names the channels; export it again with its header")
        first = next((at for at in range(names[1], len(rows)) if rows[at] and is_number(rows[at][0], Spelling("."))), len(rows))
        last = next((at for at in range(first, len(rows)) if not any(rows[at]) or rows[at][0] == END), len(rows))
        return cls(file, rows[: names[1]], [row for row in rows[names[1] : first] if any(row)], rows[first:last], first + 1)

    def start(self) -> datetime:
        """When the export starts: its milliseconds count from there."""
        told = next((row[1] for row in self.about if row[0:1] and row[0] in STARTS and len(row) > 1), "")
        if not told.isdigit():
            raise UserError(f"{self.file}: no row {STARTS[0]!r} with a file time; export it again with its header")
        return ZERO + timedelta(microseconds=int(told) // 10)

    def channels(self) -> list[Channel]:
        """Each with the times of the time column to its left."""
        width = max(len(row) for row in self.head)
        keys = [at for at in range(width) if all(_cell(row, at) == row[0] for row in self.head)]
        names, units = self.head[0], next((row for row in self.head if row[0] == UNIT), [])
        values = self._numbers(width)
        found = []
        for at in range(width):
            if at in keys or not _cell(names, at):
                continue
            time = self._seconds(values[:, max(key for key in keys if key < at)])
            sampled = np.isfinite(time)
            found.append(Channel(_cell(names, at), _unit(_cell(units, at)), time[sampled], values[sampled, at]))
        return found

    def _numbers(self, width: int) -> Samples:
        """The body (n, width), NaN for an empty cell: a channel that is slower ends sooner."""
        spelling = Spelling(_decimal(self.body))
        values = np.full((len(self.body), width), np.nan)
        for at, row in enumerate(self.body):
            for column, cell in enumerate(row[:width]):
                value = number(cell, spelling)
                if value is None:
                    name = _cell(self.head[0], column)
                    raise UserError(f"{self.file}: column {name!r} row {self.first + at}: {cell!r} is not a number; correct it")
                values[at, column] = value
        return values

    def _seconds(self, told: Samples) -> Samples:
        """Since the start of the export [s]."""
        if np.nanmax(told, initial=0.0) < FULL:
            return told / 1000.0
        return (told - (self.start() - ZERO) / timedelta(seconds=1) * TICKS) / TICKS


def _delimiter(file: Path, lines: Sequence[str]) -> str:
    """What stands behind the first cell. Names may contain blanks, so these separate no cells."""
    sign = lines[0].removeprefix("\ufeff")[len(NAME) :][:1] if lines else ""
    if sign in ("\t", ";", ",", ":"):
        return sign
    raise UserError(
        f"{file}: its cells are not separated by tab, semicolon, comma or colon, and names may contain blanks; export it again"
    )


def _cell(row: Row, at: int) -> str:
    return row[at] if at < len(row) else ""


def _decimal(body: Sequence[Row]) -> Decimal:
    """A comma where any cell has one: digits are not grouped. The header may have the other sign."""
    return "," if any("," in cell for row in body for cell in row) else "."


def _unit(told: str) -> str | None:
    """`mm (Length)` as `mm`; None for `(None)` and what no column of a recording has."""
    unit = told.partition(" (")[0]
    return unit if canonical(unit) else None
