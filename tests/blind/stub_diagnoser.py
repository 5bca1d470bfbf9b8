"""A diagnosing process whose answers follow from the case's number, and that writes down everything it was told."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from drivetwin.blind.serving import serve

STARTED_IN = os.getcwd()
AXIS = "joint"


class StubDiagnosis:
    """Names stribeck with a probability by the case's number."""

    def diagnose(self, model: Path, training: Sequence[Path], validation: Sequence[Path], out: Path) -> None:
        number = int(model.read_text(encoding="utf-8"))
        (out / "prediction").mkdir(parents=True)
        (out / "report.json").write_text(json.dumps(report(number)), encoding="utf-8")
        told = [model, *training, *validation, out]
        seen = {"argv": sys.orig_argv, "environ": dict(os.environ), "cwd": STARTED_IN, "told": [str(path) for path in told]}
        visible = sorted(str(path) for path in Path().rglob("*"))
        (out / "seen.json").write_text(json.dumps({**seen, "visible": visible}), encoding="utf-8")
        for recording in validation:
            predict(out / "prediction" / f"{recording.name}.parquet", 0.1 + 0.01 * number)

    def predict(self, model: Path, report: Path, recording: Path, out: Path) -> None:
        assert json.loads(report.read_text(encoding="utf-8"))["causes"][0]["effect"] == "stribeck"
        assert recording.is_dir()
        out.mkdir(exist_ok=True)
        predict(out / f"{recording.name}.parquet", 0.2)


def report(number: int) -> dict[str, object]:
    """A gap report that keeps to the contract."""
    probability = 0.6 + 0.05 * number
    found = {"value": 1.3, "unit": "N·m", "ci90": [1.2, 1.4]}
    shrink = {"validation": 0.97, "ci90": [0.95, 0.98], "of_explainable": 0.99}
    words = {"indistinguishable_from": [], "tell_apart_by": ""}
    stribeck = {"effect": "stribeck", "axis": AXIS, "probability": probability, "parameters": {"static_torque": found}}
    unknown = {"effect": "unknown", "axis": AXIS, "probability": 1.0 - probability, "parameters": {}, "gap_closed": None}
    levels = {"torque_rms": 3.0, "gap_rms": 1.0, "noise_rms": 0.05, "standstill_rms": 0.1, "significant": True}
    return {
        "schema": "gap-report/1",
        "version": "0",
        "inputs": {},
        "seed": 0,
        "verdict": "explained",
        "filter": {"cutoff_hz": 48.0, "standstill_velocity": {AXIS: 0.01}},
        "axes": {AXIS: {**levels, "test": {"name": "t", "p_value": 0.0}, "where": [], "patterns": []}},
        "causes": [{"step": 1, **stribeck, "gap_closed": shrink, **words}, {"step": 1, **unknown, **words}],
        "selected": [{"effect": "stribeck", "axis": AXIS}],
        "after": {AXIS: {"gap_rms": 0.1}},
    }


def predict(path: Path, after: float) -> None:
    """A gap of 1 before, and of `after` after."""
    ones = np.ones(100)
    columns = {"torque_before": 0.0 * ones, "torque_after": (1.0 - after) * ones, "torque_measured": ones, "used": ones > 0.0}
    pq.write_table(pa.table({"time": 0.001 * np.arange(100), **{f"{AXIS}.{name}": v for name, v in columns.items()}}), path)


if __name__ == "__main__":
    serve(StubDiagnosis(), sys.stdin, sys.stdout)
