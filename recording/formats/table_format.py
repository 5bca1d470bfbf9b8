"""Formats that are tables: the columns that the map names, in SI units on the joint side, and their time."""

from __future__ import annotations

import logging
from abc import abstractmethod
from datetime import datetime
from pathlib import Path

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.checks import REPAIRED, UNREPAIRED, Advice, check_finite, check_lengths
from drivetwin.recording.formats.base import Columns, ImportFormat, Signals
from drivetwin.recording.import_map import ISO, AxisMap, ColumnMap, ImportMap, TimeMap
from drivetwin.recording.recording import Samples, needed
from drivetwin.recording.repair import Repaired, repair
from drivetwin.recording.table import Column, Table
from drivetwin.recording.to_joint import to_joint_side
from drivetwin.recording.units import unit_for

logger = logging.getLogger(__name__)


class TableFormat(ImportFormat):
    """A format of named columns, one of which is the time, unless the map gives the period."""

    @abstractmethod
    def table(self, file: Path, import_map: ImportMap) -> Table:
        """The columns of a file. Raises UserError for what cannot be read."""

    def signals(self, file: Path, import_map: ImportMap, *, mend: bool) -> Signals:
        return _table_signals(self.table(file, import_map), import_map, mend)


def _table_signals(table: Table, import_map: ImportMap, mend: bool) -> Signals:
    file = table.file
    columns: Columns = {
        axis: {
            name: values
            for name, column in entry.columns.items()
            if (values := _table_column(table, axis, entry, name, column)) is not None
        }
        for axis, entry in import_map.axes.items()
    }
    time, start = _table_time(table, import_map, columns)
    flat = {f"{axis}.{name}": values for axis, named in columns.items() for name, values in named.items()}
    check_lengths(str(file), time, flat)
    mended = repair(time, columns) if mend else Repaired(time, columns, {})
    if mended.changes:
        logger.warning("%s is repaired: %s", file, mended.words())
    _check_finite(file, mended.time, mended.columns, REPAIRED if mend else UNREPAIRED)
    return Signals(mended.time, mended.columns, import_map.axes, (file, import_map.path), start, mended.changes)


def _table_column(table: Table, axis: str, entry: AxisMap, name: str, column: ColumnMap) -> Samples | None:
    where = f"{axis}.{name}"
    if column.column is None:
        raise UserError(f"{table.file}: {where}: a table has columns, not objects; give `column:` in the map")
    if column.optional and table.find(column.column) is None:
        return None
    source = table.column(column.column, where)
    unit = column.unit or source.unit
    if unit is None:
        raise UserError(
            f"{table.file}: {where}: the file names no unit for column {column.column!r}; give `unit:` in the map"
        )
    return to_joint_side(f"{table.file}: {where}", name, source.read(), column.model_copy(update={"unit": unit}), entry)


def _table_time(table: Table, import_map: ImportMap, columns: Columns) -> tuple[Samples, datetime | None]:
    told = import_map.time
    if told is None:
        raise UserError(
            f"{import_map.path}: time is missing; give `time: {{column: ..., unit: s}}` or `time: {{period: 0.001}}`"
        )
    if told.period is not None:
        length = max(len(values) for named in columns.values() for values in named.values())
        return np.arange(length, dtype=np.float64) * told.period, None
    source = table.column(told.column if told.column is not None else 1, "time")
    return _since_the_first(table, source) if told.unit == ISO else (_time_column(table, source, told), None)


def _since_the_first(table: Table, source: Column) -> tuple[Samples, datetime]:
    """Seconds since the first of a column's dates and times, and that one."""
    if source.instants is None:
        raise UserError(f"{table.file}: time: this column holds numbers; give `unit: s` (ms, us) under time in the map")
    instants = source.instants()
    try:
        return np.array([(each - instants[0]).total_seconds() for each in instants]), instants[0]
    except TypeError:
        raise UserError(f"{table.file}: time: some rows name a time zone and some do not; write all in one way") from None


def _time_column(table: Table, source: Column, told: TimeMap) -> Samples:
    unit = told.unit or source.unit
    if unit is None:
        raise UserError(f"{table.file}: the file names no unit for time; give `unit: s` (ms, us) under time in the map")
    try:
        return source.read() * unit_for("time", unit).factor
    except UserError as error:
        raise UserError(f"{table.file}: time: {error}") from error


def _check_finite(file: Path, time: Samples, columns: Columns, advice: Advice) -> None:
    check_finite(str(file), "time", time, time, advice)
    for axis, named in columns.items():
        for name in needed(named):
            check_finite(str(file), f"{axis}.{name}", named[name], time, advice)
