"""Writes recordings to disk, completely or not at all."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from drivetwin.foundation.files import new_directory, provenance, write_json
from drivetwin.recording.checks import check_lengths
from drivetwin.recording.recording import COLUMNS, SCHEMA, Recording, RecordingInfo, Samples


def write_recording(recording: Recording, directory: Path, *, seed: int = 0, inputs: Iterable[Path] = ()) -> None:
    """Write `recording` as the folder `directory`, which appears whole or not at all.

    `seed` and the sha256 of `inputs` go to recording.json. Raises UserError where `directory` holds foreign files.
    """
    with new_directory(directory) as staged:
        write_into(recording, staged, seed=seed, inputs=inputs)


def write_into(recording: Recording, staged: Path, *, seed: int = 0, inputs: Iterable[Path] = ()) -> None:
    """Write recording.json and signals.parquet into `staged`, a folder that somebody else makes appear as a whole."""
    staged.mkdir(parents=True, exist_ok=True)
    columns = _flat(recording)
    check_lengths(recording.name, recording.time, columns)
    arrays = {"time": recording.time, **columns}
    table = pa.table(
        {name: pa.array(np.ascontiguousarray(values, dtype=np.float64)) for name, values in arrays.items()}
    )
    pq.write_table(table, staged / "signals.parquet")
    write_json(staged / "recording.json", _payload(recording.info, provenance(seed, inputs)))


def _flat(recording: Recording) -> dict[str, Samples]:
    """`A.name` for every column, in the contract's order, what the contract does not name at the end."""
    order = {name: index for index, name in enumerate(COLUMNS)}
    return {
        f"{axis}.{name}": named[name]
        for axis, named in recording.columns.items()
        for name in sorted(named, key=lambda name: order.get(name, len(order)))
    }


def _payload(info: RecordingInfo, made_by: dict[str, Any]) -> dict[str, Any]:
    """recording.json: schema first, what is known (a null integral_time means a P loop and stays), then `made_by`."""
    known = info.model_dump(by_alias=True, exclude_unset=True, exclude={"schema_"})
    return {"schema": SCHEMA, "machine": info.machine, "derived": info.derived, **known, **made_by}
