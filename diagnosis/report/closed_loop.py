"""The simulation moved as the machine was moved, on the validation recordings that have a demand: how far it shrinks there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.scratch import scratch
from drivetwin.recording.recording import Recording
from drivetwin.twin.comparison import Comparison, compared

DEMANDS = ("position_demand", "velocity_demand")


def in_closed_loop(found: Diagnosis, model: Path) -> Diagnosis:
    """The diagnosis with its validation recordings replayed by the model as it stands, and by the patched one with the effects.

    Where a recording has a demand and cannot be replayed, a note says why.
    """
    asked = [recording for recording in found.validation if _has_demand(recording)]
    if not asked:
        return found
    cutoff_hz = max(gap.cutoff_hz for gap in found.axes.values())
    replayed: list[Comparison] = []
    notes: list[str] = []
    with scratch() as folder:
        patched = folder / "patched.xml"
        patched.write_text(found.model_xml, encoding="utf-8")
        for recording in asked:
            try:
                replayed.append(compared(model, recording, found.selected, cutoff_hz, patched=patched))
            except UserError as error:
                notes.append(f"not moved in closed loop: {error}")
    if replayed and found.held_back:
        notes.append("in closed loop whole recordings are moved, with what was fitted of them")
    return replace(found, closed_loop=tuple(replayed), notes=(*found.notes, *notes))


def _has_demand(recording: Recording) -> bool:
    return any(name in columns for columns in recording.columns.values() for name in DEMANDS)
