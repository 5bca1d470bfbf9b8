"""Diagnosis: recordings to the gap of each axis, its causes step by step, and a simulation that has them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from threadpoolctl import threadpool_limits

from diagnosis.comparison import Comparison
from diagnosis.hold_back import hold_back
from diagnosis.inputs import without_position
from diagnosis.judge import Judge
from diagnosis.measured import prepare, thresholds
from diagnosis.noise import noise_of
from diagnosis.nominal import nominal_parameters
from diagnosis.result import Diagnosis
from diagnosis.selection import select_causes
from diagnosis.settings import DiagnosisSettings
from diagnosis.simulation import simulation
from drivetwin.recording.recording import Recording

Progress = Callable[[str, float], None]


TURN = 5e-4
"""After which a thread passes Python's lock on [s]: what runs without it takes less than Python's usual 5 ms."""


@contextmanager
def _threads_that_wait_little() -> Iterator[None]:
    """One for the linear algebra, whose matrices are small; those that search side by side take turns more often."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(TURN)
    try:
        with threadpool_limits(1):
            yield
    finally:
        sys.setswitchinterval(usual)


@_threads_that_wait_little()
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
    fitted, held = hold_back(training, settings.cutoff_hz) if held_back else (list(training), list(validation))
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
