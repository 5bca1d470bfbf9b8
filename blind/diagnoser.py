"""The process that diagnoses and knows no truth: what `drivetwin diagnose` does, and its first cause on motion not seen yet.

Started as `python -m blind.diagnoser` with next to no environment, in a folder of nobody; it is told where a case stands.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path

import pyarrow.parquet as pq

from blind.serving import serve
from diagnosis.diagnose import diagnose
from diagnosis.gap_report import CausePart, read_report
from diagnosis.inputs import read_inputs
from diagnosis.measured import prepare
from diagnosis.prediction import Patch, predict
from diagnosis.settings import DiagnosisSettings
from diagnosis.simulation import Simulation, simulation
from diagnosis.write import prediction_table, write_diagnosis
from drivetwin.recording.reader import read_recording
from emulator.effects import PlacedEffect
from emulator.effects.library import library

_MASS_SCALE = "mass_scale_"
"""A parameter of this name and a body's says by what factor the body is heavier than in the model."""


class GapDiagnosis:
    """The diagnosis of this release."""

    def diagnose(self, model: Path, training: Sequence[Path], validation: Sequence[Path], out: Path) -> None:
        """Write what `drivetwin diagnose MODEL TRAINING... --validate VALIDATION... --out OUT --no-html` writes."""
        settings = DiagnosisSettings()
        inputs = read_inputs(model, training, validation, cutoff_hz=settings.cutoff_hz, allow_gaps=False)
        found = diagnose(model, inputs.training, inputs.validation, settings, lambda _what, _share: None)
        out.mkdir()
        write_diagnosis(found, inputs.files, out, html=False)

    def predict(self, model: Path, report: Path, recording: Path, out: Path) -> None:
        """Write OUT/NAME.parquet: a recording's prediction with the first cause alone, by the report's filter and threshold."""
        told = read_report(report)
        out.mkdir(exist_ok=True)
        for piece in read_recording(recording):
            twin = simulation(model, piece.info.axes)
            standstill = {axis: told.filter.standstill_velocity.get(axis, math.inf) for axis in twin.axes}
            run = prepare(twin, piece, told.filter.cutoff_hz, standstill)
            prediction = predict(twin, run, first_cause(twin, told.causes[0]))
            pq.write_table(prediction_table(prediction), out / f"{piece.name}.parquet")


def first_cause(twin: Simulation, cause: CausePart) -> Patch:
    """What a cause of step 1 adds to the simulation, with the parameters that the report gives; nothing without any."""
    values = {name: estimate.value for name, estimate in cause.parameters.items()}
    heavier = {
        int(twin.model.body(name.removeprefix(_MASS_SCALE)).id): values.pop(name) - 1.0
        for name in tuple(values)
        if name.startswith(_MASS_SCALE)
    }
    if not values or cause.axis is None:
        return Patch((), heavier)
    effect = library()[cause.effect](**values)
    units = {name: cause.parameters[name].unit for name in values}
    return Patch((PlacedEffect(cause.axis, effect, units),), heavier)


if __name__ == "__main__":
    serve(GapDiagnosis(), sys.stdin, sys.stdout)
