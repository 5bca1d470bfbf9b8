"""A case's folder as traces: the truth of every axis, the drives' states, the faults that struck."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivetwin.hil_tests.folder import TRUTH, VERDICT
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import Recording, Samples


@dataclass(frozen=True)
class Mark:
    """Something that happened at a simulated time [s]."""

    time: float
    text: str


@dataclass(frozen=True)
class AxisTrace:
    """One axis as it truly moved: `position` and `demand` (n,) in `unit` (`m` or `rad`), `torque` (n,) joint side [N or N·m].

    `demand` is NaN where the drive is not enabled. `states` are the drive's, each from its time on.
    """

    unit: str
    position: Samples
    demand: Samples
    torque: Samples
    states: tuple[Mark, ...]

    @property
    def tracking_error(self) -> Samples:
        """Demand less position (n,) in `unit`."""
        return self.demand - self.position

    @property
    def torque_unit(self) -> str:
        """`N` or `N·m`."""
        return "N" if self.unit == "m" else "N·m"


@dataclass(frozen=True)
class Traces:
    """A case's truth: `time` (n,) [s], in pieces of equal steps; faults that struck."""

    time: Samples
    axes: dict[str, AxisTrace]
    faults: tuple[Mark, ...]


def read_traces(folder: Path) -> Traces | None:
    """The truth in a case's folder (`drivetwin.hil_tests.folder.write_case`); None where no time has passed in it.

    Raises UserError where a recording cannot be read.
    """
    places = sorted(folder.glob(f"{TRUTH}*"))
    if not places:
        return None
    verdict = json.loads((folder / VERDICT).read_text(encoding="utf-8"))
    pieces = [piece for place in places for piece in read_recording(place)]
    pieces.sort(key=lambda piece: float(piece.time[0]))
    return Traces(
        time=np.concatenate([piece.time for piece in pieces]),
        axes={axis: _axis(axis, unit, pieces, verdict["states"]) for axis, unit in verdict["units"].items()},
        faults=tuple(Mark(one["time"], one["fault"]) for one in verdict["faults"] if one["time"] is not None),
    )


def _axis(axis: str, unit: str, pieces: Sequence[Recording], states: Sequence[dict[str, str]]) -> AxisTrace:
    position, demand, torque, enabled = (
        np.concatenate([piece.columns[axis][name] for piece in pieces])
        for name in ("position", "position_demand", "torque", "enabled")
    )
    own = tuple(Mark(float(change["time"]), change["state"]) for change in states if change["axis"] == axis)
    return AxisTrace(unit, position, np.where(enabled > 0.0, demand, np.nan), torque, own)
