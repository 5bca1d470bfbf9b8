"""The process that diagnoses and knows no truth: what `drivetwin diagnose` does, and its first cause on motion not seen yet.

Started as `python -m drivetwin.blind.diagnoser [EFFECTS.py ...]` with next to no environment, in a folder of nobody; it is told
where a case stands.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import pyarrow.parquet as pq

from drivetwin.blind.serving import serve
from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.cutoff import motion_cutoff
from drivetwin.diagnosis.prepare.inputs import read_inputs
from drivetwin.diagnosis.prepare.motion import begins, prepare, standstill_of
from drivetwin.diagnosis.prepare.simulation import simulation
from drivetwin.diagnosis.report.prediction import Patch, predict
from drivetwin.diagnosis.report.schema import CausePart, read_report
from drivetwin.diagnosis.report.write import prediction_table, write_diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import PlacedEffect, add_effects, library, read_effect_file
from drivetwin.recording.reader import read_recording


class GapDiagnosis:
    """The diagnosis of this release."""

    def diagnose(self, model: Path, training: Sequence[Path], validation: Sequence[Path], out: Path) -> None:
        """Write what `drivetwin diagnose MODEL TRAINING... --validate VALIDATION... --out OUT --no-html` writes."""
        settings = Settings()
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
            cutoff = max(axis.cutoff_hz for axis in told.axes.values())
            motion = motion_cutoff([piece], twin.home_inertia())
            standstill = standstill_of(twin, [piece], min(cutoff, motion))[0]
            run = prepare(twin, piece, cutoff, motion, standstill, begins([piece])[0])
            prediction = predict(twin, run, first_cause(told.causes[0] if told.causes else None))
            pq.write_table(prediction_table(prediction), out / f"{piece.name}.parquet")


def first_cause(cause: CausePart | None) -> Patch:
    """What the first cause adds to the simulation, with the parameters that the report gives; nothing without any."""
    if cause is None or not cause.parameters:
        return Patch()
    effect = library()[cause.effect](**{name: estimate.value for name, estimate in cause.parameters.items()})
    units = {name: estimate.unit for name, estimate in cause.parameters.items()}
    return Patch((PlacedEffect(cause.axis, effect, units),))


if __name__ == "__main__":
    add_effects(read_effect_file(Path(name)) for name in sys.argv[1:])
    serve(GapDiagnosis(), sys.stdin, sys.stdout)
