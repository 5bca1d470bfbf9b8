"""ASAM MDF files (MDF 4, and 3) as tables: a channel is a column, and channels of other rates are brought onto one time."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats.table_format import TableFormat
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.in_child import UnreadableError, read_in_child
from drivetwin.recording.recording import Samples
from drivetwin.recording.table import Column, Table

logger = logging.getLogger(__name__)

LIBRARY = "asammdf"
GAP = 1.5
"""Step between two samples of a channel, in its usual steps, across which nothing is interpolated."""


class Mdf(TableFormat):
    """MDF files; column 1 is `time`, common to all, and each other one a channel."""

    name: ClassVar[str] = "mdf"
    endings: ClassVar[tuple[str, ...]] = (".mf4", ".mdf")

    def table(self, file: Path, import_map: ImportMap) -> Table:
        start, channels = read_mdf(file)
        return _on_one_time(file, start, channels, import_map)


@dataclass(frozen=True)
class Channel:
    """A channel's `values` (n,) at `time` (n,) [s] since the start of the file; `unit` is None where the file names none."""

    name: str
    unit: str | None
    time: Samples
    values: Samples


def read_mdf(file: Path) -> tuple[datetime, list[Channel]]:
    """When the time of a file starts, and its numeric channels with their conversions applied.

    Raises UserError for what is no MDF file, and ModuleNotFoundError where the library of the extra is missing.
    """
    if find_spec(LIBRARY) is None:
        raise ModuleNotFoundError(f"No module named {LIBRARY!r}", name=LIBRARY)
    try:
        found = read_in_child("mdf", file)
    except (OSError, UnreadableError) as error:
        raise UserError(f"{file} cannot be read as an MDF file: {error}") from error
    named = enumerate(zip(found["names"].tolist(), found["units"].tolist(), strict=True))
    channels = [Channel(name, unit or None, found[f"time {at}"], found[f"values {at}"]) for at, (name, unit) in named]
    return datetime.fromisoformat(str(found["start"])), channels


def _on_one_time(file: Path, start: datetime, channels: list[Channel], import_map: ImportMap) -> Table:
    """The rows are the samples of the fastest channel that the map names, where all that it names have samples."""
    named = [channel for channel in _named(file, channels, import_map) if len(channel.time) > 1]
    rows = max((channel.time for channel in named), key=len, default=np.empty(0))
    first = max((float(channel.time[0]) for channel in named), default=0.0)
    last = min((float(channel.time[-1]) for channel in named), default=0.0)
    rows = rows[(rows >= first) & (rows <= last)]
    if slower := [_with_rate(channel) for channel in named if len(channel.time) < len(rows)]:
        logger.warning("%s: interpolated onto the fastest channel: %s", file, ", ".join(slower))
    time = Column("time", "s", rows.copy, lambda: [start + timedelta(seconds=second) for second in rows.tolist()])
    columns = (Column(channel.name, channel.unit, partial(_at, file, channel, rows)) for channel in channels)
    return Table(file, (time, *columns))


def _named(file: Path, channels: list[Channel], import_map: ImportMap) -> list[Channel]:
    """Those that the map names."""
    nothing = partial(np.empty, 0)
    table = Table(file, tuple(Column(name, None, nothing) for name in ("time", *(channel.name for channel in channels))))
    keys = [column.column for axis in import_map.axes.values() for column in axis.columns.values()]
    found = [table.find(key) for key in keys if key is not None]
    numbers = {next(at for at, each in enumerate(table.columns) if each is column) for column in found if column is not None}
    return [channels[number - 1] for number in sorted(numbers) if number > 0]


def _with_rate(channel: Channel) -> str:
    return f"{channel.name} ({1.0 / float(np.median(np.diff(channel.time))):.4g} Hz)"


def _at(file: Path, channel: Channel, rows: Samples) -> Samples:
    """The values at the times `rows` (n,): as they are, or linearly between two samples that no gap parts."""
    values = np.asarray(channel.values, dtype=np.float64)
    if np.array_equal(channel.time, rows):
        return values
    steps = np.diff(channel.time)
    if not len(steps) or not (steps > 0.0).all():
        raise UserError(f"{file}: channel {channel.name!r}: its time does not rise, so it cannot be read at other times")
    wide = np.flatnonzero(steps > GAP * np.median(steps))
    if len(wide):
        at, until = channel.time[wide[0]], channel.time[wide[0] + 1]
        raise UserError(f"{file}: channel {channel.name!r} has no samples from {at:g} to {until:g} s; cut the file at the gap")
    return np.interp(rows, channel.time, values)
