"""Channels of a logger, each with times of its own, as one table: the slower ones are brought onto the fastest."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.checks import GAP_FACTOR
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.recording import Samples
from drivetwin.recording.table import Column, Table

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Channel:
    """A channel at `time` (n,) [s] since the start of the file; `read` gives its values (n,), or raises UserError.

    `unit` is None where the file names none. `doubt`: what the file does not tell of its values.
    """

    name: str
    unit: str | None
    time: Samples
    read: Callable[[], Samples]
    doubt: str = ""


def on_one_time(file: Path, start: datetime, channels: Sequence[Channel], import_map: ImportMap) -> Table:
    """A table whose column 1 is `time`, and each other one a channel.

    The rows are the samples of the fastest channel that the map names, where all that it names have samples. Reading a column
    raises UserError where its samples leave a gap, or do not rise in time.
    """
    named = [channel for channel in _named(file, channels, import_map) if len(channel.time) > 1]
    rows = max((channel.time for channel in named), key=_rate, default=np.empty(0))
    first = max((float(channel.time[0]) for channel in named), default=0.0)
    last = min((float(channel.time[-1]) for channel in named), default=0.0)
    rows = rows[(rows >= first) & (rows <= last)]
    if slower := [f"{channel.name} ({_rate(channel.time):.4g} Hz)" for channel in named if not _same(channel.time, rows)]:
        logger.warning("%s: interpolated onto the fastest channel: %s", file, ", ".join(slower))
    for doubt in (f"{channel.name}: {channel.doubt}" for channel in named if channel.doubt):
        logger.warning("%s: %s", file, doubt)
    time = Column("time", "s", rows.copy, lambda: [start + timedelta(seconds=second) for second in rows.tolist()])
    columns = (Column(channel.name, channel.unit, partial(_at, file, channel, rows)) for channel in channels)
    return Table(file, (time, *columns))


def _named(file: Path, channels: Sequence[Channel], import_map: ImportMap) -> list[Channel]:
    """Those that the map names."""
    nothing = partial(np.empty, 0)
    table = Table(file, tuple(Column(name, None, nothing) for name in ("time", *(channel.name for channel in channels))))
    keys = [column.column for axis in import_map.axes.values() for column in axis.columns.values()]
    found = [table.find(key) for key in keys if key is not None]
    numbers = {next(at for at, each in enumerate(table.columns) if each is column) for column in found if column is not None}
    return [channels[number - 1] for number in sorted(numbers) if number > 0]


def _rate(time: Samples) -> float:
    """Samples a second."""
    return (len(time) - 1) / max(float(time[-1] - time[0]), 1e-300)


def _same(time: Samples, rows: Samples) -> bool:
    """Whether the rows are samples of a channel themselves."""
    return bool(np.isin(rows, time).all())


def _at(file: Path, channel: Channel, rows: Samples) -> Samples:
    """The values at the times `rows` (n,): as they are, or linearly between two samples that no gap parts."""
    if np.array_equal(channel.time, rows):
        return channel.read()
    steps = np.diff(channel.time)
    if not len(steps):
        raise UserError(f"{file}: channel {channel.name!r} has {len(channel.time)} samples; a recording needs at least 2")
    if not (steps > 0.0).all():
        raise UserError(f"{file}: channel {channel.name!r}: its time does not rise, so it cannot be read at other times")
    inside = (channel.time[1:] > rows[0]) & (channel.time[:-1] < rows[-1]) if len(rows) else np.zeros(len(steps), np.bool_)
    wide = np.flatnonzero((steps > GAP_FACTOR * np.median(steps)) & inside)
    if len(wide) and not _same(channel.time, rows):
        at, until = channel.time[wide[0]], channel.time[wide[0] + 1]
        raise UserError(f"{file}: channel {channel.name!r} has no samples from {at:g} to {until:g} s; cut the file at the gap")
    return np.interp(rows, channel.time, channel.read())
