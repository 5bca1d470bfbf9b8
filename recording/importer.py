"""Foreign files into recordings: columns by the map, units to SI on the joint side, and the contract's checks."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from drivetwin.foundation.errors import UserError
from drivetwin.recording.bus_log import LOG_SUFFIXES, BusSignals, read_bus_log
from drivetwin.recording.checks import TOLERANCE, check_finite, check_lengths, gaps, refuse_gap
from drivetwin.recording.csv_table import read_csv_table
from drivetwin.recording.import_map import ISO, AxisMap, ColumnMap, ImportMap, TimeMap
from drivetwin.recording.matlab_table import read_matlab
from drivetwin.recording.recording import COLUMNS, AxisInfo, Recording, RecordingInfo, Samples, needed
from drivetwin.recording.repair import Repaired, repair
from drivetwin.recording.table import Column, Table
from drivetwin.recording.to_joint import to_joint_side
from drivetwin.recording.units import unit_for

logger = logging.getLogger(__name__)

TABLE_SUFFIXES = (".csv", ".txt", ".tsv", ".dat")

Columns = dict[str, dict[str, Samples]]


@dataclass(frozen=True)
class _Signals:
    """What a file holds: `time` (n,) [s], columns on the joint side, and the axes with all constants known.

    `start`: the date and time at which `time` is 0, where the file tells. `repaired`: as in `Repaired.changes`.
    """

    time: Samples
    columns: Columns
    axes: dict[str, AxisMap]
    files: tuple[Path, ...]
    start: datetime | None = None
    repaired: dict[str, int] = field(default_factory=dict)


def import_recordings(
    files: Sequence[Path],
    import_map: ImportMap,
    *,
    mend: bool = False,
    done: Callable[[Path], None] | None = None,
) -> list[Recording]:
    """One recording a file, in their order, named by the file's stem (made unique by the folders above it).

    `mend`: as in `import_recording`. `done` is called with each file that is through. Raises UserError naming file, column
    and row.
    """
    recordings = []
    for file, name in zip(files, unique_names(files), strict=True):
        recordings.append(import_recording(file, import_map, name=name, mend=mend))
        if done is not None:
            done(file)
    return recordings


def import_recording(file: Path, import_map: ImportMap, *, name: str | None = None, mend: bool = False) -> Recording:
    """The recording in `file`; its `files` are what it was made of: the file, the map, and an EDS where one was read.

    `mend`: a table's repeated rows and single missing samples are repaired (`repair`), and `repaired` says how many.
    Raises UserError for a file, a column or a unit that does not fit the map, and for what a recording may not be.
    """
    if not file.is_file():
        raise UserError(f"{file} does not exist; give the files to import")
    signals = _bus_signals(file, import_map) if _format(file, import_map) == "bus" else _table_signals(file, import_map, mend)
    signals = _on_equal_steps(file, signals, import_map)
    period = _period(signals.time)
    starts = gaps(str(file), signals.time, period)
    if starts and import_map.gaps == "refuse":
        error = refuse_gap(str(file), signals.time, starts[0], period)
        raise UserError(f"{str(error).partition('; record again')[0]}; record again, or say `gaps: keep` in the map")
    derived = _integrate_positions(signals, starts)
    info = _info(import_map, signals, period, derived)
    return Recording(name or file.stem, info, signals.time, signals.columns, files=signals.files)


def unique_names(files: Sequence[Path]) -> list[str]:
    """File stems; where they are the same, with as many parent folders before them as it takes.

    Raises UserError where a file is given twice.
    """
    paths = [file.absolute() for file in files]
    for path, count in Counter(paths).items():
        if count > 1:
            raise UserError(f"{path} is given twice; give every file once")
    names = [path.stem for path in paths]
    for depth in range(1, max((len(path.parts) for path in paths), default=0)):
        taken = Counter(names)
        names = [
            name if taken[name] == 1 else "_".join([*path.parent.parts[-depth:], path.stem]).strip("/")
            for name, path in zip(names, paths, strict=True)
        ]
    taken = Counter(names)
    # a.csv and a.mat in one folder differ by their ending only.
    return [name if taken[name] == 1 else path.name.replace(".", "_") for name, path in zip(names, paths, strict=True)]


def _format(file: Path, import_map: ImportMap) -> str:
    suffix = file.suffix.lower()
    if import_map.format is not None:
        return import_map.format
    if suffix == ".mat":
        return "matlab"
    if suffix in LOG_SUFFIXES:
        return "bus"
    if suffix in TABLE_SUFFIXES:
        return "csv"
    raise UserError(
        f"{file}: what {suffix or 'a file without an ending'} holds is not known; say `format: csv`, `matlab` or "
        "`bus` in the map"
    )


def _table_signals(file: Path, import_map: ImportMap, mend: bool) -> _Signals:
    table = read_matlab(file) if _format(file, import_map) == "matlab" else read_csv_table(file, import_map.csv)
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
        logger.warning("%s is repaired: %s", file, ", ".join(f"{count} of {what}" for what, count in mended.changes.items()))
    _check_finite(file, mended.time, mended.columns)
    return _Signals(mended.time, mended.columns, import_map.axes, (file, import_map.path), start, mended.changes)


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
        raise UserError(f"{table.file}: time: a MATLAB file holds numbers; give `unit: s` (ms, us) under time in the map")
    instants = source.instants()
    try:
        return np.array([(each - instants[0]).total_seconds() for each in instants]), instants[0]
    except TypeError:
        raise UserError(f"{table.file}: time: some rows name their time zone and some do not; write all alike") from None


def _time_column(table: Table, source: Column, told: TimeMap) -> Samples:
    unit = told.unit or source.unit
    if unit is None:
        raise UserError(f"{table.file}: the file names no unit for time; give `unit: s` (ms, us) under time in the map")
    try:
        return source.read() * unit_for("time", unit).factor
    except UserError as error:
        raise UserError(f"{table.file}: time: {error}") from error


def _bus_signals(file: Path, import_map: ImportMap) -> _Signals:
    if import_map.time is not None:
        logger.warning("%s: `time` is not used for a bus log, its rows are SYNC cycles", import_map.path)
    bus = read_bus_log(file, import_map)
    columns = {
        axis: {name: _bus_column(file, axis, name, values, bus) for name, values in named.items()}
        for axis, named in bus.raw.items()
    }
    return _Signals(bus.time, columns, bus.axes, (file, import_map.path, *bus.files))


def _bus_column(file: Path, axis: str, name: str, raw: Samples, bus: BusSignals) -> Samples:
    entry = bus.axes[axis]
    column = entry.columns[name]
    if column.unit is None:
        raise UserError(
            f"{file}: {axis}.{name}: an object has no unit of its own; give `unit:` in the map (inc, permille ...)"
        )
    try:
        return to_joint_side(f"{file}: {axis}.{name}", name, raw, column, entry)
    except UserError as error:
        if not bus.unconfirmed[axis]:
            raise
        raise UserError(
            f"{error}; the EDS has only defaults of {', '.join(bus.unconfirmed[axis])}, which the log does not confirm, and "
            "the drive may be set otherwise: give the constant in the map, the DCF as `eds`, or a log of reading the object"
        ) from None


def _check_finite(file: Path, time: Samples, columns: Columns) -> None:
    check_finite(str(file), "time", time, time)
    for axis, named in columns.items():
        for name in needed(named):
            check_finite(str(file), f"{axis}.{name}", named[name], time)


def _period(time: Samples) -> float:
    """The step of `time` [s]: its mean where that is like its median, to the digits that a clock has."""
    if len(time) < 2:
        raise UserError(f"the file has {len(time)} samples; a recording needs at least 2")
    median = float(np.median(np.diff(time)))
    mean = float(time[-1] - time[0]) / (len(time) - 1)
    period = mean if abs(mean - median) < 1e-3 * abs(median) else median
    return float(f"{period:.6g}") if period > 0 else 1.0


def _on_equal_steps(file: Path, signals: _Signals, import_map: ImportMap) -> _Signals:
    """`signals` as they are, or by linear interpolation on the period that the map asks for."""
    period = import_map.resample
    time = signals.time
    if len(time) < 2:
        raise UserError(f"{file} holds {len(time)} samples; a recording needs at least 2")
    if period is None:
        return signals
    steps = np.diff(time)
    falling = np.flatnonzero(steps <= 0)
    if falling.size:
        raise UserError(
            f"{file}: column time falls or stands still at row {int(falling[0]) + 2}; sort the rows before resampling"
        )
    median = float(np.median(steps))
    wide = np.flatnonzero(steps > _BRIDGED * max(median, period))
    if wide.size:
        at = int(wide[0])
        raise UserError(
            f"{file}: column time has a gap of {steps[at]:g} s before row {at + 2}; resampling does not invent what "
            f"was lost (steps up to {_BRIDGED * max(median, period):g} s are bridged): cut the file there"
        )
    if period > (1 + TOLERANCE) * median:
        logger.warning(
            "%s: resampled from %g to %g s without a filter; what is faster is aliased", file, median, period
        )
    grid = time[0] + np.arange(int((time[-1] - time[0]) / period * (1 + 1e-12)) + 1) * period
    columns = {
        axis: {name: np.interp(grid, time, values) for name, values in named.items()}
        for axis, named in signals.columns.items()
    }
    return replace(signals, time=grid, columns=columns)


_BRIDGED = 4.0


def _integrate_positions(signals: _Signals, starts: list[int]) -> list[str]:
    """Add positions that only velocities were recorded for (trapezoid); the names of what was added.

    Raises UserError across a gap, where how far the axis went is not known.
    """
    derived = []
    for axis, named in signals.columns.items():
        if "position" in named:
            continue
        if starts:
            raise UserError(
                f"{signals.files[0]}: {axis}.position cannot be integrated across a gap; cut the file at it"
            )
        travelled = cumulative_trapezoid(named["velocity"], signals.time, initial=0)
        named["position"] = signals.axes[axis].initial_position + travelled
        derived.append(f"{axis}.position")
    return derived


def _info(import_map: ImportMap, signals: _Signals, period: float, derived: list[str]) -> RecordingInfo:
    payload: dict[str, Any] = {
        "machine": import_map.machine,
        "sample_period": period,
        "start_time": signals.start if import_map.start_time is None else import_map.start_time,
        "derived": derived,
        "axes": {axis: _axis_info(axis, entry) for axis, entry in signals.axes.items()},
    }
    extra = {"about": import_map.about, "repaired": signals.repaired}
    return RecordingInfo.model_validate(payload | {key: value for key, value in extra.items() if value})


def _axis_info(axis: str, entry: AxisMap) -> AxisInfo:
    known: dict[str, Any] = {
        "joint": entry.joint or axis,
        "actuator": entry.actuator,
        "rated_torque": entry.joint_rated_torque(),
        "torque_resolution": entry.torque_resolution,
        "torque_bandwidth_hz": entry.torque_bandwidth_hz,
        "torque_delay": entry.torque_delay,
        "position_resolution": entry.position_resolution,
        "position_relative": entry.position_relative or None,
        "gear_ratio": entry.gear_ratio,
        "drive": entry.drive,
    }
    return AxisInfo.model_validate({name: value for name, value in known.items() if value is not None})


def ordered(named: dict[str, Samples]) -> list[str]:
    """The names of an axis' columns in the contract's order."""
    return sorted(named, key=COLUMNS.index)
