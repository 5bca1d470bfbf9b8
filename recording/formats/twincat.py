"""TwinCAT Scope exports as text: a block of rows about the file, one about each channel, then times and values in pairs.

As of TwinCAT 3 Scope View (Beckhoff TE13xx, "Export in csv"): channels have time columns of their own, or share them with the
channels of the same sample time to their right; times are milliseconds since the start, or Windows file times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats.channels import Channel, on_one_time
from drivetwin.recording.formats.table_format import TableFormat
from drivetwin.recording.formats.text import Decimal, Spelling, decoded, is_number, number
from drivetwin.recording.import_map import ISO, ImportMap
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
FULL, LONGEST = 16, 18
"""Digits, at least, of a time that is a file time and no number of milliseconds; and of a file time, at most."""
SCALING = {"Offset": "0", "ScaleFactor": "1", "Unit ScaleFactor": "1", "Unit Offset": "0"}
"""First cells of rows about how values are scaled, and what leaves them as they are."""
SIGNS = ("\t", ";", ",", ":")
"""What may separate cells."""
ZERO = datetime(1601, 1, 1, tzinfo=UTC)

Row = list[str]
Index = NDArray[np.intp]
DECIMALS: tuple[Decimal, ...] = (".", ",")


class TwinCat(TableFormat):
    """TwinCAT Scope exports; column 1 is `time`, common to all, and each other one a channel."""

    name: ClassVar[str] = "twincat"
    endings: ClassVar[tuple[str, ...]] = (".csv", ".txt")

    @classmethod
    def recognises(cls, file: Path) -> bool:
        """By its first cell and the row of its start."""
        try:
            with file.open("rb") as stream:
                raw = stream.read(HEAD)
        except OSError:
            return False
        wide = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
        head = raw.decode("utf-16" if wide else "utf-8", errors="replace").removeprefix("\ufeff").splitlines()
        return (
            bool(head)
            and head[0].startswith(tuple(NAME + sign for sign in SIGNS))
            and any(line.startswith(tuple(start + sign for start in STARTS for sign in SIGNS)) for line in head)
        )

    def table(self, file: Path, import_map: ImportMap) -> Table:
        if set(import_map.csv.model_fields_set) - {"encoding"}:
            raise UserError(
                f"{import_map.path}: csv: {file.name} is an export of TwinCAT Scope, which tells its layout itself; "
                "leave these keys out, or say `format: csv`"
            )
        if import_map.time is not None and import_map.time.unit not in (None, "s", ISO):
            raise UserError(
                f"{import_map.path}: time.unit: column `time` of an export of TwinCAT Scope is in s; leave the unit out, or "
                f"say `{ISO}`"
            )
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
    """The cells of a file. `head`: rows about each channel; `body`: rows of numbers, with their lines, counted from 1."""

    file: Path
    about: Sequence[Row]
    head: Sequence[Row]
    body: Sequence[tuple[int, Row]]

    @classmethod
    def of(cls, file: Path, encoding: str | None) -> _Export:
        lines = decoded(file, encoding).removeprefix("\ufeff").splitlines()
        delimiter = _delimiter(file, lines)
        rows = [[cell.strip() for cell in line.split(delimiter)] for line in lines]
        names = [at for at, row in enumerate(rows) if row[0] == NAME]
        if len(names) < 2:
            raise UserError(f"{file}: no row {NAME!r} that names the channels; export it again with its header")
        first = next((at for at in range(names[1], len(rows)) if _is_number(rows[at][0])), len(rows))
        last = next((at for at in range(first, len(rows)) if rows[at][0] == END), len(rows))
        head = [row for row in rows[names[1] : first] if any(row)]
        body = [(at + 1, rows[at]) for at in range(first, last) if any(rows[at])]
        width = max(len(row) for row in head)
        for line, row in body:
            if any(row[width:]):
                raise UserError(
                    f"{file}: row {line} has {len(row)} cells, the header {width}; export it with another delimiter"
                )
        return cls(file, rows[: names[1]], head, body)

    def start(self) -> datetime:
        """When the export starts: its milliseconds count from there."""
        return ZERO + timedelta(microseconds=self._ticks() // 10)

    def channels(self) -> list[Channel]:
        """Each with the times of the time column to its left."""
        width = max(len(row) for row in self.head)
        keys = [at for at in range(width) if all(_cell(row, at) == row[0] for row in self.head)]
        names, units = self.head[0], self._row(UNIT)
        spelling = Spelling(_decimal([row for _, row in self.body]))
        times = {key: self._seconds(key, spelling) for key in keys}
        found = []
        for at in range(width):
            if at in keys or not _cell(names, at):
                continue
            time = times[max(key for key in keys if key < at)]
            there = np.flatnonzero(np.isfinite(time))
            doubt = self._doubt(at)
            unit = None if doubt else _unit(_cell(units, at))
            found.append(Channel(_cell(names, at), unit, time[there], partial(self._values, at, there, spelling), doubt))
        return found

    def _row(self, key: str) -> Row:
        return next((row for row in self.head if row[0] == key), [])

    def _doubt(self, at: int) -> str:
        """The file has the same header whether its values are scaled or not."""
        told = {key: _cell(self._row(key), at) for key in SCALING}
        scaled = {key: cell for key, cell in told.items() if cell not in ("", SCALING[key])}
        if not scaled:
            return ""
        words = ", ".join(f"{key} {cell}" for key, cell in scaled.items())
        return f"the export does not say whether its values are scaled already ({words}); check them, and give `unit`"

    def _values(self, at: int, there: Index, spelling: Spelling) -> Samples:
        """A column's numbers in some rows, NaN for an empty cell: a channel that is slower ends sooner."""
        return np.array([self._number(line, row, at, spelling) for line, row in (self.body[k] for k in there)])

    def _number(self, line: int, row: Row, at: int, spelling: Spelling) -> float:
        value = number(_cell(row, at), spelling)
        if value is None:
            name = _cell(self.head[0], at)
            raise UserError(f"{self.file}: column {name!r} row {line}: {_cell(row, at)!r} is not a number; correct it")
        return value

    def _seconds(self, at: int, spelling: Spelling) -> Samples:
        """Of a time column, since the start of the export [s]; a file time is a whole number that no float holds."""
        start = self._ticks()
        return np.array(
            [
                (int(cell) - start) / TICKS
                if len(cell := _cell(row, at)) >= FULL and cell.isdecimal()
                else self._number(line, row, at, spelling) / 1000.0
                for line, row in self.body
            ]
        )

    def _ticks(self) -> int:
        told = next((row[1] for row in self.about if row[0] in STARTS and len(row) > 1), "")
        if not (told.isascii() and told.isdecimal() and len(told) <= LONGEST):
            raise UserError(f"{self.file}: no row {STARTS[0]!r} with a file time; export it again with its header")
        return int(told)


def _delimiter(file: Path, lines: Sequence[str]) -> str:
    """What stands behind the first cell. Names may contain blanks, so these separate no cells."""
    sign = lines[0][len(NAME) :][:1] if lines else ""
    if sign in SIGNS:
        return sign
    raise UserError(
        f"{file}: its cells are not separated by tab, semicolon, comma or colon, and names may contain blanks; export it again"
    )


def _cell(row: Row, at: int) -> str:
    return row[at] if at < len(row) else ""


def _is_number(cell: str) -> bool:
    return any(is_number(cell, Spelling(decimal)) for decimal in DECIMALS)


def _decimal(body: Sequence[Row]) -> Decimal:
    """A comma where any cell has one: digits are not grouped. The header may have the other sign."""
    return "," if any("," in cell for row in body for cell in row) else "."


def _unit(told: str) -> str | None:
    """`mm (Length)` as `mm`; None for `(None)` and what no column of a recording has."""
    unit = told.partition(" (")[0]
    return unit if canonical(unit) else None
