"""Text tables of any layout: delimiter, decimal sign, header, units row and encoding are detected or given."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections import Counter
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import ClassVar

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats.table_format import TableFormat
from drivetwin.recording.formats.text import Decimal, Spelling, decoded, is_number, number
from drivetwin.recording.import_map import CsvLayout, ImportMap
from drivetwin.recording.recording import Samples
from drivetwin.recording.table import Column, Table
from drivetwin.recording.units import canonical

WHITESPACE = "whitespace"
_DELIMITERS = (";", "\t", ",", "|", WHITESPACE)
_SAMPLE_LINES = 300

Row = list[str]


@dataclass(frozen=True)
class _Line:
    """A line of the file that is neither empty nor a comment; `number` counts from 1 as an editor does."""

    number: int
    text: str


@dataclass(frozen=True)
class _Source:
    """The lines of a file and their cells."""

    file: Path
    lines: list[_Line]
    rows: list[Row]


@dataclass(frozen=True)
class _Cells:
    """The text of one column; `rows` are its line numbers."""

    file: Path
    name: str
    cells: list[str]
    rows: list[int]
    spelling: Spelling

    def instants(self) -> list[datetime]:
        """The cells as ISO dates and times; raises UserError naming the row of one that is none."""
        found = []
        for row, cell in zip(self.rows, self.cells, strict=True):
            try:
                found.append(datetime.fromisoformat(cell.replace(",", ".")))
            except ValueError:
                raise UserError(
                    f"{self.file}: column {self.name!r} row {row}: {cell!r} is not an ISO date and time "
                    "(2026-11-23T08:15:00.001); correct it, or give another unit of time in the map"
                ) from None
        return found

    def read(self) -> Samples:
        """The numbers, NaN for an empty cell; raises UserError naming the row of a cell that is text."""
        values = np.empty(len(self.cells))
        for index, cell in enumerate(self.cells):
            value = number(cell, self.spelling)
            if value is None:
                raise UserError(
                    f"{self.file}: column {self.name!r} row {self.rows[index]}: {cell!r} is not a number; correct it, "
                    "or give csv.decimal, csv.thousands, csv.comment or csv.first_row in the map"
                )
            values[index] = value
        return values


class Csv(TableFormat):
    """Text tables; what the map says of their layout is under `csv`."""

    name: ClassVar[str] = "csv"
    endings: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".tsv", ".dat")

    def table(self, file: Path, import_map: ImportMap) -> Table:
        return read_csv_table(file, import_map.csv)


def read_csv_table(file: Path, layout: CsvLayout) -> Table:
    """The columns of a text table, found as `layout` says and otherwise from the file itself.

    Raises UserError where the file cannot be decoded, holds no numbers, or has rows of another width.
    """
    lines = _lines(file, layout)
    delimiter, spelling = _separators(file, lines, layout)
    source = _Source(file, lines, [_cells(line.text, delimiter) for line in lines])
    first = _first_row(source, spelling, layout)
    width = Counter(len(row) for row in source.rows[first:]).most_common(1)[0][0]
    names, units = _header(source, first, width, layout)
    body = [_fit(file, line, row, width) for line, row in zip(lines[first:], source.rows[first:], strict=True)]
    numbers = [line.number for line in lines[first:]]
    columns = (_Cells(file, name, [row[index] for row in body], numbers, spelling) for index, name in enumerate(names))
    told = zip(columns, units, strict=True)
    return Table(file, tuple(Column(cells.name, unit, cells.read, cells.instants) for cells, unit in told))


def _lines(file: Path, layout: CsvLayout) -> list[_Line]:
    text = decoded(file, layout.encoding)
    lines = [_Line(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
    if layout.comment:
        lines = [line for line in lines if not line.text.lstrip().startswith(layout.comment)]
    if not lines:
        raise UserError(f"{file} is empty; export it again")
    return lines


def _cells(text: str, delimiter: str) -> Row:
    if delimiter == WHITESPACE:
        return text.split()
    return [cell.strip() for cell in next(csv.reader(io.StringIO(text), delimiter=delimiter))]


def _separators(file: Path, lines: list[_Line], layout: CsvLayout) -> tuple[str, Spelling]:
    """Delimiter and decimal sign under which the last lines of the file have the most numbers and the least text."""
    delimiters = (_told(layout.delimiter),) if layout.delimiter else _DELIMITERS
    decimals: tuple[Decimal, ...] = (layout.decimal,) if layout.decimal else (".", ",")
    sample = lines[-_SAMPLE_LINES:]
    best: tuple[int, str, Spelling] | None = None
    for delimiter, decimal in itertools.product(delimiters, decimals):
        if decimal in (delimiter, layout.thousands):
            continue
        spelling = Spelling(decimal, layout.thousands or "")
        rows = [_cells(line.text, delimiter) for line in sample]
        cells = [cell for row in rows for cell in row if cell]
        numeric = sum(is_number(cell, spelling) for cell in cells)
        score = 2 * numeric - len(cells) if numeric else -len(cells) - 1
        # A trailing or empty cell still speaks for a real delimiter, so a tie goes to the wider row.
        if best is None or score > best[0]:
            best = (score, delimiter, spelling)
    if best is None:
        raise UserError(f"{file}: csv.decimal is csv.delimiter or csv.thousands in the map too; they must differ")
    return best[1], best[2]


def _told(delimiter: str) -> str:
    if delimiter in ("tab", "\\t"):
        return "\t"
    if delimiter in (WHITESPACE, " "):
        return WHITESPACE
    return delimiter


def _first_row(source: _Source, spelling: Spelling, layout: CsvLayout) -> int:
    """Index of the first row of numbers: as wide as the rows at the end, a number wherever most of those have one."""
    file, lines, rows = source.file, source.lines, source.rows
    if layout.first_row is not None:
        found = next((index for index, line in enumerate(lines) if line.number >= layout.first_row), None)
        if found is None:
            raise UserError(f"{file}: csv.first_row is {layout.first_row}, the file ends at row {lines[-1].number}")
        return found
    # The end of a file is numbers, however long its preamble is.
    tail = rows[-max(1, len(rows) // 3) :]
    width = Counter(len(row) for row in tail).most_common(1)[0][0]
    wide = [row for row in tail if len(row) == width]
    numeric = [
        column for column in range(width) if 2 * sum(is_number(row[column], spelling) for row in wide) > len(wide)
    ]
    for index, row in enumerate(rows):
        if len(row) == width and _is_data([row[column] for column in numeric], spelling):
            return index
    raise UserError(
        f"{file}: no rows of numbers found; give csv.delimiter, csv.decimal and csv.first_row in the map "
        f"(its row {lines[-1].number} reads {lines[-1].text[:60]!r})"
    )


def _is_data(cells: list[str], spelling: Spelling) -> bool:
    """Cells of the numeric columns: each a number or empty, and not all of them empty."""
    return any(cells) and all(number(cell, spelling) is not None for cell in cells)


def _header(source: _Source, first: int, width: int, layout: CsvLayout) -> tuple[list[str], list[str | None]]:
    """Names and units of the columns, from the rows told or from those just above the first row of numbers."""
    units: Row = []
    names: Row = []
    above = [index for index in range(max(0, first - 2), first) if len(source.rows[index]) == width]
    if layout.units_row:
        units = source.rows[_row_index(source, layout.units_row, "units_row")]
    elif layout.units_row is None and above and _is_units(source.rows[above[-1]]):
        units = source.rows[above.pop()]
    if layout.header_row:
        names = source.rows[_row_index(source, layout.header_row, "header_row")]
    elif layout.header_row is None and above:
        names = source.rows[above[-1]]
    names = (names + [""] * width)[:width]
    units = (units + [""] * width)[:width]
    return names, [unit or _bracketed(name) for unit, name in zip(units, names, strict=True)]


def _row_index(source: _Source, number: int, key: str) -> int:
    for index, line in enumerate(source.lines):
        if line.number == number:
            return index
    raise UserError(
        f"{source.file}: csv.{key} is {number}, which is empty, a comment or beyond the last row "
        f"{source.lines[-1].number}"
    )


def _is_units(row: Row) -> bool:
    """A row of which every cell is empty, a unit, or something in brackets; and at least one is a unit."""
    told = [cell for cell in row if cell]
    return any(canonical(cell) for cell in told) and all(
        canonical(cell) or (cell.startswith("[") and cell.endswith("]")) or cell in ("-", "1") for cell in told
    )


def _bracketed(name: str) -> str | None:
    """The unit in `Speed [rpm]` or `Speed (rpm)`, None where there is none."""
    match = re.search(r"[\[(]([^\[\]()]+)[\])]$", name.rstrip())
    return match[1] if match and canonical(match[1]) else None


def _fit(file: Path, line: _Line, row: Row, width: int) -> Row:
    """The row at `width` cells; cells beyond it must be empty, cells short of it are."""
    if len(row) > width and any(row[width:]):
        raise UserError(
            f"{file}: row {line.number} has {len(row)} cells where most have {width}; correct that row, "
            "or give csv.delimiter and csv.decimal in the map"
        )
    return (row + [""] * width)[:width]
