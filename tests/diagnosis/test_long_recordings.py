"""Of long recordings a search decides on a part; the values of what it finds are those of all that was recorded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import PERIOD, Swing, diagnosed, strokes

from drivetwin.diagnosis.prepare import rows as of_rows
from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.recording.recording import Recording

AMPLITUDE, PERIODS, COULOMB = 0.6, 40.0, 3.0
"""Of a ripple of the column, twice a turn of its motor [N·m, 1/rad], and of a friction of the lift [N]."""


def ripple(at: Swing) -> Array:
    return np.asarray(AMPLITUDE * np.cos(PERIODS * at.position + 0.4))


def friction(at: Swing) -> Array:
    return np.asarray(COULOMB * np.sign(at.velocity))


def recorded(seed: int, name: str) -> Recording:
    return strokes(seed, 75.0 if name == "fitted" else 25.0, {"turn": ripple, "lift": friction}, name)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """By all that was recorded."""
    return diagnosed(tmp_path_factory.mktemp("whole"), recorded)


def test_values_and_intervals_are_those_of_the_whole_recording(
    whole: Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(of_rows, "SEARCHED", int(25.0 / PERIOD))
    found = diagnosed(tmp_path, recorded)
    assert {(one.axis, one.effect.name) for one in whole.selected} == {("turn", "torque_ripple"), ("lift", "coulomb")}
    assert {(one.axis, one.effect.name) for one in found.selected} == {(one.axis, one.effect.name) for one in whole.selected}
    expected = {(one.axis, one.effect): one for one in whole.causes}
    for one in found.causes:
        for name, value in one.parameters.items():
            other = expected[one.axis, one.effect].parameters[name]
            half = np.ptp(other.ci90) / 2.0
            assert value.value == pytest.approx(other.value, abs=0.1 * half)
            assert np.ptp(value.ci90) / 2.0 == pytest.approx(half, rel=0.1)
