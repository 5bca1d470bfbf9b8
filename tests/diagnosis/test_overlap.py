"""Causes that overlap, of an axis whose torque is a formula: none takes what is another's, equals are told as equal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_bench import Machine
from rig_bench import diagnosed, strokes

from drivetwin.recording.recording import Recording

CONSTANT = -0.2


def weaker(recording: Recording) -> Recording:
    """The same machine under a motor whose torque constant is a fifth less than is told: it shows more current."""
    (axis,) = recording.columns
    own = recording.columns[axis]
    return replace(recording, columns={axis: {**own, "torque": own["torque"] / (1.0 + CONSTANT)}})


def test_a_torque_constant_beside_stribeck_and_cogging_is_found_in_its_size() -> None:
    machine = Machine()
    found = machine.diagnosed([weaker(machine.recording(1, 30.0, "fitted"))], [weaker(machine.recording(2, 15.0, "held"))])
    causes = {cause.effect: cause for cause in found.causes if cause.gap_closed is not None}
    assert {"torque_constant", "stribeck", "torque_ripple"} <= set(causes)
    assert causes["torque_constant"].parameters["error"].value == pytest.approx(CONSTANT, rel=0.1)
    assert causes["torque_constant"].probability > 0.9
    assert found.after_rms["turn"] < 0.1 * found.axes["turn"].gap_rms


def test_a_wave_of_one_speed_is_named_as_all_that_it_may_be() -> None:
    """Then a ripple and a position friction of a motor turn are the same torque to the last digit."""
    time = np.arange(6000, dtype=np.float64) * 0.004
    plain = Machine().recording(1, 24.0, "only")
    position = 0.9 * time
    torque = 1.0 + 0.3 * 0.9 + 0.3 * np.sin(10.0 * position) + 0.02 * np.random.default_rng(5).standard_normal(len(time))
    steady = replace(plain, columns={"turn": {"position": position, "torque": torque}})
    found = Machine().diagnosed([steady], [])
    first = found.causes[0]
    assert first.probability > 0.9
    assert {first.effect, *first.indistinguishable_from} >= {"torque_ripple", "position_friction"}


def test_a_constant_torque_on_a_lift_is_no_certain_payload(tmp_path: Path) -> None:
    """A mass that is a little off, a friction that differs with the direction and an offset of the torque are one torque."""

    def pulled(seed: int, name: str) -> Recording:
        return strokes(seed, 20.0, {"lift": lambda at: np.full_like(at.velocity, 2.0)}, name)

    found = diagnosed(tmp_path, pulled)
    first = next(cause for cause in found.causes if cause.axis == "lift")
    assert {first.effect, *first.indistinguishable_from} >= {"payload", "torque_offset", "coulomb_asymmetry"}
    assert found.after_rms["lift"] < 0.2 * found.axes["lift"].gap_rms
