"""Diagnosis: recordings to the gap of each axis, its causes step by step, and a simulation that has them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from diagnosis.comparison import Comparison
from diagnosis.inputs import without_position
from diagnosis.judge import Judge
from diagnosis.measured import prepare, thresholds
from diagnosis.noise import noise_of
from diagnosis.nominal import nominal_parameters
from diagnosis.result import Diagnosis
from diagnosis.selection import select_causes
from diagnosis.settings import DiagnosisSettings
from diagnosis.simulation import simulation
from drivetwin.motion.axis_motion import measured_position
from drivetwin.recording.recording import Recording

HELD_BACK = 0.25
"""Share at the end of each recording that is held back where there is no validation recording."""
MANY = 4
"""Recordings, of which one in so many is held back whole."""

Progress = Callable[[str, float], None]


@contextmanager
def _linear_algebra_on_one_thread() -> Iterator[None]:
    """Matrices are small here: threads of the linear algebra wait for each other more than they work."""
    with threadpool_limits(1):
        yield


@_linear_algebra_on_one_thread()
def diagnose(
    model: Path,
    training: Sequence[Recording],
    validation: Sequence[Recording],
    settings: DiagnosisSettings,
    progress: Progress,
) -> Diagnosis:
    """The causes of the gap, fitted on `training`, their shrink measured on `validation` (blocks held back where empty).

    Raises UserError where a recording's axes do not fit the model.
    """
    held_back = not validation
    fitted, held = _hold_back(training) if held_back else (list(training), list(validation))
    twin = simulation(model, fitted[0].info.axes)
    standstill = thresholds(twin, [*fitted, *held], settings.cutoff_hz)
    progress("filter, inverse dynamics", 0.05)
    runs = [prepare(twin, recording, settings.cutoff_hz, standstill) for recording in fitted]
    checks = [prepare(twin, recording, settings.cutoff_hz, standstill) for recording in held]
    comparison = Comparison(twin, runs, without_position(fitted))
    noise = {axis: noise_of(axis, [*runs, *checks]) for axis in twin.axes}
    selection = select_causes(
        comparison, nominal_parameters(comparison), {axis: one.floor for axis, one in noise.items()}, progress
    )
    progress("gap, shrink, intervals", 0.9)
    unseen = Comparison(twin, checks, without_position(held))
    return Judge(twin, comparison, unseen, selection, runs, checks, noise, settings, standstill, held_back).diagnosis()


def _hold_back(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Recording]]:
    """What is fitted, and what is not: every fourth recording by speed where there are many, else the end of each.

    The slowest and the fastest are always fitted: what happens there is not to be told from the others.
    """
    if len(recordings) >= MANY:
        by_speed = sorted(recordings, key=_speed)
        held = by_speed[MANY // 2 : -1 : MANY]
        return [one for one in recordings if all(one is not other for other in held)], held
    fitted, held = [], []
    for one in recordings:
        cut = round(len(one.time) * (1.0 - HELD_BACK))
        fitted.append(_piece(one, slice(0, cut), one.name))
        held.append(_piece(one, slice(cut, None), one.name))
    return fitted, held


def _speed(one: Recording) -> float:
    """Mean speed of its fastest axis, in the axis's own unit."""
    period = one.info.sample_period
    return max(
        float(np.mean(np.abs(np.diff(measured_position(columns, period))))) / period for columns in one.columns.values()
    )


def _piece(one: Recording, span: slice, name: str) -> Recording:
    columns = {axis: {key: values[span] for key, values in named.items()} for axis, named in one.columns.items()}
    return replace(one, name=name, time=one.time[span], columns=columns)
