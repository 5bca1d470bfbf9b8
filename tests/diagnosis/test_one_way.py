"""Motion in one direction only: what is named may be what only the other direction would set apart, and the report says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, PERIOD, TURNING, VISCOUS, diagnosed, recording, strokes, written_model

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording

SECONDS, ASYMMETRY = 24.0, 0.6
"""Of a friction that is as much more one way as it is less the other way [N·m]."""


def travelled(seed: int) -> Recording:
    """The column at speeds between 0.1 and 2 rad/s, always the same way."""
    time = np.arange(round(SECONDS / PERIOD), dtype=np.float64) * PERIOD
    angle = 2.0 * np.pi * time
    speed = 1.05 + 0.55 * np.sin(0.31 * angle + seed) + 0.4 * np.sin(0.83 * angle + 2.0 * seed)
    position = np.cumsum(speed) * PERIOD
    velocity = np.gradient(position, PERIOD)
    friction = COULOMB["turn"] * np.sign(velocity) + ASYMMETRY + VISCOUS["turn"] * velocity
    torque = TURNING * np.gradient(velocity, PERIOD) + friction
    return recording({"turn": torque}, {"turn": position}, seed, f"way_{seed}", noise=2.0)


@pytest.fixture(scope="module")
def one_way(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    model, training = written_model(tmp_path_factory.mktemp("one_way")), [travelled(1), travelled(2)]
    return diagnose(model, training, [travelled(3)], Settings(), lambda _stage, _share: None)


def test_what_is_named_may_be_what_the_other_direction_would_set_apart(one_way: Diagnosis) -> None:
    named = one_way.causes[0]
    assert (named.effect, named.axis) == ("coulomb", "turn")
    assert {"coulomb_asymmetry", "torque_offset"} <= set(named.indistinguishable_from)
    assert "temperature_drift" not in named.indistinguishable_from


def test_what_only_the_other_direction_would_set_apart_is_not_named_itself(one_way: Diagnosis) -> None:
    asked_in_vain = {one.effect for one in one_way.axes["turn"].not_testable}
    assert {"coulomb_asymmetry", "torque_offset", "viscous_asymmetry"} <= asked_in_vain
    assert not asked_in_vain & {one.effect.name for one in one_way.selected}
    assert not asked_in_vain & {one.effect for one in one_way.causes}


def test_of_both_directions_the_level_is_not_mistaken(tmp_path: Path) -> None:
    more = {"turn": lambda at: np.full_like(at.position, ASYMMETRY)}
    named = diagnosed(tmp_path, lambda seed, name: strokes(seed, SECONDS, more, name)).causes[0]
    assert named.effect in ("coulomb_asymmetry", "torque_offset")
    assert "coulomb" not in named.indistinguishable_from
