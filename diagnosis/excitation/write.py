"""A planned motion as files: set-points to stream, the same as CSV, what it is for, and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pc
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.plan import Passage, Plan
from drivetwin.foundation.files import provenance, write_json

SCHEMA = "excitation/1"


def write_plan(found: Plan, inputs: Sequence[Path], directory: Path) -> None:
    """Write setpoints.parquet, setpoints.csv, motion.json and motion.png into `directory`, which exists.

    Set-points: `time` [s] and `A.position` [m or rad] of every axis that moves, one a cycle; CSV for any controller.
    """
    table = pa.table({"time": found.time, **{f"{axis}.position": path for axis, path in found.paths.items()}})
    pq.write_table(table, directory / "setpoints.parquet")
    pc.write_csv(table, directory / "setpoints.csv")
    write_json(directory / "motion.json", _told(found) | provenance(0, inputs, directory))
    _picture(found).savefig(directory / "motion.png", dpi=110)


def _told(found: Plan) -> dict[str, Any]:
    question = found.question
    return {
        "schema": SCHEMA,
        "axis": question.axis,
        "tells_apart": list(question.effects),
        "tell_apart_by": question.tell_apart_by,
        "sample_period": found.period,
        "duration": float(found.time[-1]),
        "start": {axis: float(path[0]) for axis, path in found.paths.items()},
        "passages": [_passage(each) for each in found.passages],
        "limits": {axis: _limits(each) for axis, each in found.limits.items()},
    }


def _passage(passage: Passage) -> dict[str, Any]:
    one = passage.excitation
    return {
        "name": one.name,
        "purpose": one.purpose,
        "begin": passage.begin,
        "end": passage.end,
        "other_axes_at": dict(passage.pose),
    }


def _limits(limits: AxisLimits) -> dict[str, Any]:
    most = limits.most
    return {"travel": list(limits.travel), "speed": most.speed, "acceleration": most.acceleration, "jerk": most.jerk}


def _picture(found: Plan) -> Figure:
    """Position of every axis over time, and the speed of the axis in question; passages by name."""
    axis, period = found.question.axis, found.period
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    place, speed = figure.subplots(2, 1, sharex=True)
    for name, path in found.paths.items():
        place.plot(found.time, path, linewidth=1.0, label=name)
    speed.plot(found.time, np.gradient(found.paths[axis], period), linewidth=0.8)
    for passage in found.passages:
        place.axvline(passage.begin, color="#999999", linewidth=0.6)
        place.annotate(
            passage.excitation.name.replace("_", " "),
            (0.5 * (passage.begin + passage.end), 1.0),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="bottom",
            fontsize=8,
        )
    place.set_ylabel("position [m or rad]")
    place.legend(loc="upper right")
    speed.set_ylabel(f"speed of {axis} [per s]")
    speed.set_xlabel("time [s]")
    figure.suptitle(f"To tell apart on {axis}: {', '.join(effect.replace('_', ' ') for effect in found.question.effects)}")
    return figure
