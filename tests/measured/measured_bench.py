"""A machine made by formula, written as recordings, and gap reports made by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

Array = NDArray[np.float64]

AXIS = "motor"
PERIOD = 0.001
INERTIA, COULOMB, VISCOUS = 0.02, 0.5, 0.1

MODEL = f"""<mujoco><option gravity="0 0 0"/><worldbody><body>
<joint name="{AXIS}" type="hinge" axis="0 0 1" frictionloss="{COULOMB}" damping="{VISCOUS}"/>
<inertial mass="1" pos="0 0 0" diaginertia="0.02 0.02 {INERTIA}"/></body></worldbody>
<actuator><motor joint="{AXIS}"/></actuator></mujoco>"""


def swing(seconds: float = 10.0, amplitude: float = 3.0, frequency: float = 0.5, phase: float = 0.0) -> tuple[Array, ...]:
    """Time, position, velocity, acceleration of a sine about 0, (n,) each."""
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    angle = 2.0 * np.pi * frequency * time + phase
    rate = 2.0 * np.pi * frequency
    position = amplitude * np.sin(angle)
    return time, position, amplitude * rate * np.cos(angle), -rate**2 * position


def rigid(velocity: Array, acceleration: Array) -> Array:
    """Torque (n,) of the simulation as it stands."""
    return np.asarray(INERTIA * acceleration + COULOMB * np.sign(velocity) + VISCOUS * velocity)


def write_recording(folder: Path, time: Array, position: Array, torque: Array, axis: str = AXIS) -> Path:
    """One axis as recording/1."""
    folder.mkdir(parents=True)
    told = {"schema": "recording/1", "machine": "bench", "sample_period": float(time[1] - time[0]), "axes": {axis: {}}}
    (folder / "recording.json").write_text(json.dumps(told), encoding="utf-8")
    columns = {"time": time, f"{axis}.position": position, f"{axis}.torque": torque}
    pq.write_table(pa.table(columns), folder / "signals.parquet")
    return folder


def write_prediction(file: Path, before: Array, after: Array, measured: Array, used: NDArray[np.bool_]) -> None:
    """prediction/NAME.parquet."""
    file.parent.mkdir(parents=True, exist_ok=True)
    columns = {"torque_before": before, "torque_after": after, "torque_measured": measured, "used": used}
    time = np.arange(len(before), dtype=np.float64) * PERIOD
    table = {"time": time} | {f"{AXIS}.{name}": each for name, each in columns.items()}
    pq.write_table(pa.table(table), file)


def cause(effect: str, probability: float = 0.95, axis: str = AXIS, share: float = 0.8) -> dict[str, Any]:
    """One entry of `causes`."""
    return {"effect": effect, "axis": axis, "probability": probability, "share": share}


def report(
    causes: list[dict[str, Any]],
    *,
    selected: list[str] | None = None,
    verdict: str = "explained",
    before: float = 1.0,
    after: float = 0.5,
    axis: str = AXIS,
    settings: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """What the score reads of gap-report/2."""
    return {
        "schema": "gap-report/2",
        "verdict": verdict,
        "settings": {"seed": 0} if settings is None else settings,
        "axes": {axis: {"cutoff_hz": 40.0, "standstill_velocity": 0.1, "torque_rms": 3.0, "gap_rms": before}},
        "causes": causes,
        "selected": [{"effect": effect, "axis": axis} for effect in selected or []],
        "after": {axis: {"gap_rms": after}},
    }
