"""What a case leaves in its folder: bus.log, truth/ (recording/2), controller.log, the controller's own files, verdict.json."""

from __future__ import annotations

import hashlib
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.foundation.files import write_json
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.stand.log import write_log
from drivetwin.hil_tests.verdict import CaseResult
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo, Samples
from drivetwin.recording.writer import write_into

BUS_LOG, TRUTH, VERDICT, CONTROLLER_LOG = "bus.log", "truth", "verdict.json", "controller.log"

FORMAT = "verdict/1"

SHORTEST = 0.02
"""Stretch of truth that is kept [s]: before SYNC, on the wall clock, the plant goes from poll to poll, a few samples each."""


def write_case(result: CaseResult, evidence: Evidence, folder: Path) -> None:
    """Write what was seen and what was found into the case's folder."""
    write_log(evidence.frames, folder / BUS_LOG)
    for place, piece in enumerate(_even_pieces(evidence.truth.time)):
        name = TRUTH if place == 0 else f"{TRUTH}_{place + 1}"
        write_into(_recording(name, evidence, piece), folder / name, seed=evidence.bench.seed)
    write_json(folder / VERDICT, _verdict(result, evidence))


def digest(folders: list[Path]) -> str:
    """sha256 over bus.log and verdict.json of all cases: the same for two runs in lockstep."""
    found = hashlib.sha256()
    for folder in folders:
        for name in (BUS_LOG, VERDICT):
            found.update(f"{folder.name}/{name}\n".encode())
            found.update((folder / name).read_bytes())
    return found.hexdigest()


def _verdict(result: CaseResult, evidence: Evidence) -> dict[str, Any]:
    """verdict.json: simulated time only, so that two runs in lockstep write the same bytes."""
    told = asdict(result)
    for key in ("wall", "folder", "tries"):
        told.pop(key)
    return {
        "format": FORMAT,
        **_without_infinity(told),
        "faults": [{"fault": struck.text, "time": struck.time} for struck in evidence.struck],
        "runs": [
            {"ending": run.ending.value, "status": run.status, "began": run.began, "ended": run.ended} for run in evidence.runs
        ],
        "units": dict(zip(evidence.axes, evidence.units, strict=True)),
        "states": [
            {"time": change.time, "axis": change.axis, "state": change.after.name.lower()} for change in evidence.states
        ],
    }


def _without_infinity(value: Any) -> Any:
    """The same with null for what JSON has no number for: a quantity that never came about."""
    if isinstance(value, dict):
        return {key: _without_infinity(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_without_infinity(one) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def _even_pieces(time: Samples) -> list[slice]:
    """Stretches of samples in equal steps, the longest first: a controller may change the cycle."""
    if len(time) < 3:
        return []
    steps = np.rint(np.diff(time) * 1e6)
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(steps)) + 1, [len(steps)]])
    stretches = [slice(int(first), int(last) + 1) for first, last in pairwise(cuts) if last - first > 2]
    pieces = [one for one in stretches if time[one.stop - 1] - time[one.start] >= SHORTEST]
    return sorted(pieces, key=lambda piece: piece.start - piece.stop)


def _recording(name: str, evidence: Evidence, piece: slice) -> Recording:
    truth = evidence.truth
    columns = {
        axis: {
            "position": truth.position[piece, number],
            "velocity": truth.velocity[piece, number],
            "torque": truth.torque[piece, number],
            "position_demand": truth.demand[piece, number],
            "enabled": truth.enabled[piece, number].astype(np.float64),
            "mode": truth.mode[piece, number].astype(np.float64),
        }
        for number, axis in enumerate(evidence.axes)
    }
    time = truth.time[piece]
    axes = {
        axis: AxisInfo(joint=machine_axis.joint, actuator=machine_axis.actuator, gear_ratio=machine_axis.gear_ratio)
        for axis, machine_axis in evidence.bench.virtual.axes.items()
    }
    period = float(np.rint((time[1] - time[0]) * 1e6)) * 1e-6
    info = RecordingInfo(machine=evidence.bench.machine_name, sample_period=period, axes=axes)
    return Recording(name=name, info=info, time=time, columns=columns)
