"""A diagnosis as files: report.json, report.html, the patched simulation, what it predicts for each validation recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from drivetwin.diagnosis.report.page import write_report_page
from drivetwin.diagnosis.report.result import AxisGap, Cause, CorrectedMass, Diagnosis, Prediction
from drivetwin.diagnosis.report.schema import (
    SCHEMA,
    AfterPart,
    AxisPart,
    CausePart,
    ClosedLoopPart,
    GapReport,
    MassPart,
    ResidualPart,
    SelectedPart,
    TestPart,
)
from drivetwin.emulator.effects.file import effects_payload
from drivetwin.foundation.files import provenance, write_json
from drivetwin.twin.write import axis_payload

Closing = TypeVar("Closing", Cause, CorrectedMass)
"""What closes a part of a gap."""


def write_diagnosis(
    diagnosis: Diagnosis,
    inputs: Sequence[Path],
    directory: Path,
    *,
    html: bool = True,
    progress: Callable[[str], None] = lambda _name: None,
) -> None:
    """Write report.json, patched.xml, effects.json, prediction/NAME.parquet and, with `html`, report.html into `directory`.

    The directory exists. `inputs` are the model and the files of every recording: their sha256 goes to report.json, with their
    paths as they are given. `progress` is told the name of each file before it is made.
    """
    made_by = provenance(diagnosis.settings.seed, inputs, directory)
    progress("report.json")
    write_json(directory / "report.json", report_of(diagnosis, made_by).model_dump(mode="json", by_alias=True))
    progress("patched.xml")
    (directory / "patched.xml").write_text(diagnosis.model_xml, encoding="utf-8")
    write_json(directory / "effects.json", effects_payload(diagnosis.patch) | made_by)
    progress("prediction")
    (directory / "prediction").mkdir()
    with_residual = {each.recording: each for each in diagnosis.with_residual}
    for prediction in diagnosis.predictions:
        table = prediction_table(prediction, with_residual.get(prediction.recording))
        pq.write_table(table, directory / "prediction" / f"{prediction.recording}.parquet")
    if html:
        progress("report.html")
        write_report_page(diagnosis, made_by["inputs"], directory / "report.html")


def report_of(diagnosis: Diagnosis, made_by: dict[str, Any]) -> GapReport:
    """report.json as values; `made_by` are version, seed and inputs. Raises ValidationError where the contract is broken."""
    return GapReport(
        schema=SCHEMA,
        version=made_by["version"],
        inputs=made_by["inputs"],
        seed=diagnosis.settings.seed,
        settings=asdict(diagnosis.settings),
        verdict=diagnosis.verdict,
        axes={name: _axis(gap) for name, gap in diagnosis.axes.items()},
        causes=[CausePart.model_validate(_told(cause)) for cause in diagnosis.causes],
        selected=[SelectedPart(effect=placed.effect.name, axis=placed.axis) for placed in diagnosis.selected],
        after={name: AfterPart(gap_rms=rms) for name, rms in diagnosis.after_rms.items()},
        closed_loop={
            each.recording: {name: ClosedLoopPart.model_validate(axis_payload(axis)) for name, axis in each.axes.items()}
            for each in diagnosis.closed_loop
        },
        masses=[MassPart.model_validate(_told(each)) for each in diagnosis.masses],
        residual=[
            ResidualPart(axis=each.table.axis, of_unknown=each.of_unknown, gap_rms=each.gap_rms) for each in diagnosis.residual
        ],
    )


def _told(one: Closing) -> Closing:
    """Of nothing that could be explained nothing is."""
    closed = one.gap_closed
    return one if closed is None else replace(one, gap_closed=replace(closed, of_explainable=closed.of_explainable or 0.0))


def _axis(gap: AxisGap) -> AxisPart:
    return AxisPart(
        cutoff_hz=gap.cutoff_hz,
        standstill_velocity=gap.standstill_velocity if np.isfinite(gap.standstill_velocity) else None,
        torque_rms=gap.torque_rms,
        gap_rms=gap.gap_rms,
        noise_rms=gap.noise_rms,
        model_error_rms=gap.model_error_rms,
        standstill_rms=gap.standstill_rms,
        significant=gap.significant,
        test=TestPart(name=f"{gap.test}; noise: {gap.noise_found_by}", p_value=gap.p_value),
        shares=gap.shares,
        where=gap.where,
        where_after=gap.where_after,
        patterns=gap.patterns,
        unknown=gap.unknown,
        not_testable=gap.not_testable,
    )


def prediction_table(prediction: Prediction, with_residual: Prediction | None = None) -> pa.Table:
    """Columns `time`, and for each axis A `A.torque_before`, `A.torque_after`, `A.torque_measured` [N·m or N] and `A.used`.

    Where what has no name was tabled also `A.torque_with_residual`.
    """
    columns: dict[str, Any] = {"time": prediction.time}
    for name, axis in prediction.axes.items():
        columns[f"{name}.torque_before"] = axis.before
        columns[f"{name}.torque_after"] = axis.after
        columns[f"{name}.torque_measured"] = axis.measured
        columns[f"{name}.used"] = axis.used
        if with_residual is not None:
            columns[f"{name}.torque_with_residual"] = with_residual.axes[name].after
    return pa.table({name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()})
