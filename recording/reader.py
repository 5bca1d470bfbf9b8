"""Reads recordings from disk; refuses what the contract does not allow, by file, column and row."""

from __future__ import annotations

import csv
import itertools
import json
import logging
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import ValidationError

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.text_files import parse_json
from drivetwin.recording.checks import (
    check_finite,
    check_joints,
    check_lengths,
    check_required,
    check_torque,
    gaps,
    refuse_gap,
)
from drivetwin.recording.recording import FIRST_SCHEMA, SCHEMA, Recording, RecordingInfo, Samples, needed

__all__ = ["check_joints", "check_torque", "find_recordings", "read_recording"]

logger = logging.getLogger(__name__)

INFO = "recording.json"
SIGNALS = ("signals.parquet", "signals.csv")


def find_recordings(path: Path) -> list[Path]:
    """`path` itself if it is a recording, otherwise the recordings directly below it, by name.

    Raises UserError if there is none.
    """
    if (path / INFO).is_file():
        return [path]
    if not path.is_dir():
        raise UserError(f"{path} is not a folder; a recording is a folder with {INFO} and {SIGNALS[0]} or {SIGNALS[1]}")
    below = sorted(child.parent for child in path.glob(f"*/{INFO}"))
    if not below:
        raise UserError(
            f"{path} holds no {INFO}, nor does a folder in it; give the folder of a recording, or one of recordings: "
            "`drivetwin identify` writes OUT/recordings"
        )
    return below


def read_recording(path: Path, *, allow_gaps: bool = False) -> list[Recording]:
    """Read the recording in folder `path`: a list of one recording, or with `allow_gaps` of the segments between gaps.

    Segments are named NAME-1, NAME-2, ... Raises UserError as the contract lists it: a missing required column, a column
    of unequal length, time that does not rise in equal steps, NaN or infinity in a required column, an unknown schema,
    a gap.
    """
    info_file = path / INFO
    info = _read_info(info_file)
    signals_file = _signals_file(path)
    table = _read_parquet(signals_file) if signals_file.suffix == ".parquet" else _read_csv(signals_file)
    where = str(signals_file)
    if "time" not in table:
        raise UserError(f"{where}: required column time is missing (from row 1 on); columns: {', '.join(table)}")
    time = table.pop("time")
    check_lengths(where, time, table)
    starts = gaps(where, time, info.sample_period)
    columns = _by_axis(where, info, table)
    _check_required_values(where, time, columns)
    name = path.absolute().name
    whole = Recording(name, info, time, columns, source=path, files=(info_file, signals_file))
    if not starts:
        return [whole]
    if not allow_gaps:
        raise refuse_gap(where, time, starts[0], info.sample_period)
    return _split(whole, starts)


def _read_info(file: Path) -> RecordingInfo:
    payload = _read_json(file)
    schema = payload.get("schema")
    if schema not in (FIRST_SCHEMA, SCHEMA):
        raise UserError(
            f"{file}: schema is {schema!r:.80}, this version reads {FIRST_SCHEMA!r} and {SCHEMA!r}; update drivetwin or "
            "convert the recording"
        )
    try:
        return RecordingInfo.model_validate(payload)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        raise UserError(f"{file}: {key}: {message} (got {first['input']!r:.80}); correct that key") from error


def _read_json(file: Path) -> dict[str, Any]:
    try:
        payload = parse_json(file.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise UserError(
            f"{file} does not exist; a recording is a folder with {INFO} and {SIGNALS[0]} or {SIGNALS[1]}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{file} cannot be read: {error}") from error
    except json.JSONDecodeError as error:
        raise UserError(
            f"{file}: line {error.lineno} column {error.colno}: not JSON ({error.msg}); correct it there"
        ) from error
    if not isinstance(payload, dict):
        raise UserError(f"{file}: expected a JSON object with the key schema, got {type(payload).__name__}")
    return payload


def _signals_file(path: Path) -> Path:
    for name in SIGNALS:
        if (path / name).is_file():
            return path / name
    raise UserError(
        f"{path}: neither {SIGNALS[0]} nor {SIGNALS[1]} is there; a recording needs one of them beside {INFO}"
    )


def _read_parquet(file: Path) -> dict[str, Samples]:
    try:
        table = pq.read_table(file)
        names = table.column_names
    except (OSError, pa.ArrowException, UnicodeDecodeError) as error:
        raise UserError(f"{file} cannot be read as Parquet: {error}; record or import it again") from error
    return {name: _from_arrow(file, name, table.column(name)) for name in names}


def _from_arrow(file: Path, name: str, column: Any) -> Samples:
    """A column as float64; nulls at its end make it shorter, nulls inside it are NaN."""
    try:
        values = np.asarray(column.cast(pa.float64()).to_numpy(), dtype=np.float64)
    except pa.ArrowException as error:
        raise UserError(
            f"{file}: column {name} (row 1 on) holds {column.type}, not numbers; write it as float64"
        ) from error
    present = np.flatnonzero(np.asarray(column.is_valid()))
    return values[: int(present[-1]) + 1 if present.size else 0]


def _read_csv(file: Path) -> dict[str, Samples]:
    """signals.csv: one line of column names, then numbers with a decimal point; row 1 is the first line of numbers."""
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            lines = [line for line in csv.reader(stream) if line]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"{file} cannot be read as CSV: {error}; write it as UTF-8 with commas") from error
    if not lines:
        raise UserError(f"{file} is empty; its first line names the columns, beginning with time")
    header = [name.strip() for name in lines[0]]
    for name in header:
        if header.count(name) > 1:
            raise UserError(f"{file}: column {name} stands twice in the first line; name every column once")
    for row, line in enumerate(lines[1:], start=1):
        if len(line) > len(header):
            raise UserError(
                f"{file}: row {row} has {len(line)} values for {len(header)} columns; separate by commas and write "
                "decimals with a point"
            )
    cells = itertools.zip_longest(*lines[1:], fillvalue="")
    texts = [list(column) for column in cells] or [[] for _ in header]
    texts += [[""] * (len(lines) - 1)] * (len(header) - len(texts))
    return {name: _numbers(file, name, column) for name, column in zip(header, texts, strict=True)}


def _numbers(file: Path, name: str, texts: list[str]) -> Samples:
    """A column of text as float64; empty cells at its end make it shorter, empty cells inside it are NaN."""
    length = next((index for index in range(len(texts), 0, -1) if texts[index - 1].strip()), 0)
    values = np.empty(length)
    for index, text in enumerate(texts[:length]):
        try:
            values[index] = float(text) if text.strip() else np.nan
        except ValueError:
            raise UserError(
                f"{file}: column {name} row {index + 1}: {text!r} is not a number; use a decimal point"
            ) from None
    return values


def _by_axis(where: str, info: RecordingInfo, table: dict[str, Samples]) -> dict[str, dict[str, Samples]]:
    columns: dict[str, dict[str, Samples]] = {axis: {} for axis in info.axes}
    for full_name, values in table.items():
        axis, _, name = full_name.rpartition(".")
        if axis in columns:
            columns[axis][name] = values
        else:
            logger.warning("%s: column %s belongs to no axis of recording.json and is ignored", where, full_name)
    for axis, named in columns.items():
        check_required(where, axis, named, info.schema_)
    return columns


def _check_required_values(where: str, time: Samples, columns: dict[str, dict[str, Samples]]) -> None:
    for axis, named in columns.items():
        for name in needed(named):
            check_finite(where, f"{axis}.{name}", named[name], time)


def _split(whole: Recording, starts: list[int]) -> list[Recording]:
    """The pieces of `whole` that begin at 0 and at `starts`; a piece of one sample says nothing and is left out."""
    bounds = [0, *starts, len(whole.time)]
    spans = [slice(begin, end) for begin, end in itertools.pairwise(bounds) if end - begin >= 2]
    if len(spans) < len(bounds) - 1:
        logger.warning(
            "%s: %d pieces of one sample between gaps are left out", whole.source, len(bounds) - 1 - len(spans)
        )
    return [
        Recording(
            f"{whole.name}-{number}",
            whole.info,
            whole.time[span],
            {axis: {name: values[span] for name, values in named.items()} for axis, named in whole.columns.items()},
            source=whole.source,
            files=whole.files,
        )
        for number, span in enumerate(spans, start=1)
    ]
