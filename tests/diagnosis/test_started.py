"""Recordings that do not say when they began, by a temperature that follows a first-order warming of the test's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import CUTOFF, strokes, written_model

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording

SECONDS = 16.0
WARMING = 90.0
"""Time constant [s]."""
COLD, ROOM, RISE = 0.6, 20.0, 25.0
"""Share by which the cold machine's friction is higher, and temperatures [degC, K]."""
BEGAN = {"third": 160.0, "first": 0.0, "second": 45.0, "later": 80.0}
"""In the order in which they are given, the last for validation [s]."""


def recorded(name: str, seed: int, sensor: bool = True) -> Recording:
    """The column whose friction falls as the drive's temperature rises; the clock of each file starts anew."""

    def colder(time: np.ndarray) -> np.ndarray:
        return np.asarray(np.exp(-(time + BEGAN[name]) / WARMING))

    whole = strokes(
        seed,
        SECONDS,
        {"turn": lambda at: COLD * colder(at.time) * (1.5 * np.sign(at.velocity) + 0.8 * at.velocity)},
        name,
    )
    if not sensor:
        return whole
    noise = 0.1 * np.random.default_rng(seed).standard_normal(len(whole.time))
    warmed = np.round(ROOM + RISE * (1.0 - colder(whole.time)) + noise, 1)
    warmed[::7] = np.nan  # a slow sensor
    columns = whole.columns | {"turn": whole.columns["turn"] | {"temperature": warmed}}
    return replace(whole, columns=columns, info=whole.info.model_copy(update={"schema_": "recording/2"}))


def files(sensor: bool = True) -> tuple[list[Recording], list[Recording]]:
    every = [recorded(name, seed, sensor) for seed, name in enumerate(BEGAN)]
    return every[:-1], every[-1:]


def ready(folder: Path, training: Sequence[Recording], validation: Sequence[Recording]) -> Prepared:
    return prepared(written_model(folder), training, validation, Settings(cutoff_hz=CUTOFF))


def starts(found: Prepared) -> list[float]:
    return [float(run.axes["turn"].motion.time[0]) for run in (*found.runs, *found.checks)]


def test_a_temperature_says_how_long_after_the_coldest_each_recording_began(tmp_path: Path) -> None:
    found = ready(tmp_path, *files())

    assert starts(found) == pytest.approx(list(BEGAN.values()), abs=4.0)
    assert any("by the temperature of turn, after the coldest: third 1" in note for note in found.notes)
    assert "temperature_drift" in {kind.name for kind in found.testable["turn"].kinds}


def test_without_a_sensor_or_with_a_stated_start_times_stay_as_they_are(tmp_path: Path) -> None:
    assert starts(ready(tmp_path, *files(sensor=False))) == [0.0] * len(BEGAN)

    training, validation = files()
    told = [replace(one, info=one.info.model_copy(update={"start_time": 7.0})) for one in training]
    assert starts(ready(tmp_path, told, validation)) == [7.0] * len(training) + [0.0]


def test_a_temperature_that_does_not_rise_says_nothing(tmp_path: Path) -> None:
    def steady(one: Recording) -> Recording:
        warm = np.full(len(one.time), ROOM + 0.05)
        return replace(one, columns=one.columns | {"turn": one.columns["turn"] | {"temperature": warm}})

    training, validation = ([steady(one) for one in each] for each in files())
    assert starts(ready(tmp_path, training, validation)) == [0.0] * len(BEGAN)


def test_clocks_that_differ_already_are_left_alone(tmp_path: Path) -> None:
    training, validation = files()
    apart = [replace(one, time=one.time + 100.0 * k) for k, one in enumerate(training)]
    assert starts(ready(tmp_path, apart, validation)) == [0.0, 100.0, 200.0, 0.0]


def test_a_clock_that_does_not_begin_at_zero_is_no_warming(tmp_path: Path) -> None:
    training, validation = ([replace(one, time=one.time + 1000.0) for one in each] for each in files())
    assert starts(ready(tmp_path, training, validation)) == pytest.approx(list(BEGAN.values()), abs=4.0)


@pytest.mark.parametrize("ends", [ROOM, ROOM + 30.0])
def test_a_machine_that_cools_says_nothing(ends: float, tmp_path: Path) -> None:
    """One recording cools, as after a hard run."""

    def cooling(one: Recording) -> Recording:
        warm = ends + 11.0 * np.exp(-one.time / 40.0)
        return replace(one, columns=one.columns | {"turn": one.columns["turn"] | {"temperature": warm}})

    training, validation = files()
    assert starts(ready(tmp_path, [cooling(training[0]), *training[1:]], validation)) == [0.0] * len(BEGAN)


def test_the_drift_of_a_machine_whose_temperature_was_recorded_is_found(tmp_path: Path) -> None:
    training, validation = files()
    found = diagnose(written_model(tmp_path), training, validation, Settings(cutoff_hz=CUTOFF), lambda _stage, _share: None)

    (drift,) = [one for one in found.causes if one.effect == "temperature_drift"]
    assert {(one.effect.name, one.axis) for one in found.selected} == {("temperature_drift", "turn")}
    assert drift.probability > 0.9
    assert drift.parameters["cold"].value == pytest.approx(COLD, rel=0.1)
    assert drift.parameters["time_constant"].value == pytest.approx(WARMING, rel=0.15)
