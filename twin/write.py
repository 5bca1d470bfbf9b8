"""A replay as files: replay.json, replay.html, and the signals of each recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from drivetwin.foundation.files import provenance, write_json
from drivetwin.twin.comparison import AxisComparison, Comparison
from drivetwin.twin.page import write_replay_page

SCHEMA = "replay/1"


def write_replay(
    comparisons: Sequence[Comparison], picture: str, inputs: Sequence[Path], directory: Path, *, html: bool = True
) -> None:
    """Write replay.json, signals/NAME.parquet and, with `html`, replay.html with its `picture` (SVG) into `directory`."""
    made_by = provenance(0, inputs, directory)
    write_json(directory / "replay.json", payload(comparisons) | made_by)
    (directory / "signals").mkdir()
    for comparison in comparisons:
        pq.write_table(_table(comparison), directory / "signals" / f"{comparison.recording}.parquet")
    if html:
        write_replay_page(comparisons, picture, made_by["inputs"], directory / "replay.html")


def payload(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    """replay/1 without what made it."""
    return {
        "schema": SCHEMA,
        "recordings": {
            each.recording: {
                "duration": float(each.time[-1] - each.time[0]),
                "cutoff_hz": each.cutoff_hz,
                "axes": {name: axis_payload(axis) for name, axis in each.axes.items()},
            }
            for each in comparisons
        },
    }


def axis_payload(axis: AxisComparison) -> dict[str, Any]:
    """One axis of a recording in replay/1."""
    signals = {}
    for name, measured in axis.measured.items():
        values = measured[axis.used]
        signals[name] = {
            "unit": axis.units[name],
            "measured_rms": float(np.sqrt(np.mean(values**2))),
            "measured_range": float(np.ptp(values)),
        } | {run: {"rms_error": of.apart[name].rms, "relative_error": of.apart[name].relative} for run, of in axis.runs.items()}
    return {"loops": axis.loops, "signals": signals}


def _table(comparison: Comparison) -> pa.Table:
    """Columns `time`, `A.used`, and `A.SIGNAL_measured`, `A.SIGNAL_model`, `A.SIGNAL_with_effects`."""
    columns: dict[str, Any] = {"time": comparison.time}
    for axis, found in comparison.axes.items():
        columns[f"{axis}.used"] = found.used
        for name, measured in found.measured.items():
            columns[f"{axis}.{name}_measured"] = measured
            columns |= {f"{axis}.{name}_{run}": of.signals[name] for run, of in found.runs.items()}
    return pa.table({name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()})
