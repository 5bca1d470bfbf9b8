"""A second encoder behind the gear: what of it is compared, and a gear error that torque alone hardly tells from a ripple."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, GEAR, MOTOR, TURNING, VISCOUS, as_modelled, compared, diagnosed, moved, recording, strokes

from drivetwin.diagnosis.prepare.deflection import deflection_of
from drivetwin.diagnosis.report.result import Array
from drivetwin.recording.recording import Recording

AMPLITUDE, ORDER, PHASE = 3e-4, 2.0, 0.7
WAVE = ORDER * GEAR


def uneven(seed: int, name: str = "strokes") -> Recording:
    """q = m + e(m) of `turn`, whose motor moves by a formula; torque by virtual work. Both encoders are recorded."""
    both = moved(seed, 20.0)
    motor = both["turn"]
    angle = WAVE * motor.position + PHASE
    ratio = 1.0 + AMPLITUDE * WAVE * np.cos(angle)
    speed = ratio * motor.velocity
    acceleration = ratio * motor.acceleration - AMPLITUDE * WAVE**2 * np.sin(angle) * motor.velocity**2
    joint = (TURNING - MOTOR) * acceleration + COULOMB["turn"] * np.sign(speed) + VISCOUS["turn"] * speed
    torques = as_modelled(both) | {"turn": MOTOR * motor.acceleration + ratio * joint}
    made = recording(torques, {axis: at.position for axis, at in both.items()}, seed, name)
    return with_joint(made, motor.position + AMPLITUDE * np.sin(angle) + 0.3)


def with_joint(made: Recording, position: Array) -> Recording:
    """With an encoder on the joint of `turn`, which counts from a zero of its own."""
    turn = made.columns["turn"] | {"joint_position": np.round(position / 1e-7) * 1e-7}
    return replace(made, columns=made.columns | {"turn": turn})


def test_what_is_compared_of_it_has_no_zero(tmp_path: Path) -> None:
    made = uneven(1)
    rows = compared(tmp_path, made)
    name = deflection_of("turn")
    assert rows.compared == ("turn", "lift", name)
    ahead = rows.target[name]
    assert np.mean(ahead) == pytest.approx(0.0, abs=1e-15)
    assert np.sqrt(np.mean(ahead**2)) == pytest.approx(AMPLITUDE / np.sqrt(2.0), rel=0.1)
    elsewhere = compared(tmp_path, with_joint(made, made.columns["turn"]["joint_position"] + 5.0))
    assert elsewhere.target[name] == pytest.approx(ahead, abs=2e-8)


def test_without_it_in_every_recording_or_with_a_hole_in_it_torque_alone_is_compared(tmp_path: Path) -> None:
    made = uneven(1)
    torn = made.columns["turn"]["joint_position"].copy()
    torn[700] = np.nan
    assert compared(tmp_path, with_joint(made, torn)).compared == ("turn", "lift")
    assert compared(tmp_path, made, strokes(2, 20.0, name="others")).compared == ("turn", "lift")


def test_a_gear_error_is_found_by_it(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, uneven)
    cause = found.causes[0]
    assert (cause.effect, cause.axis) == ("transmission_error", "turn")
    assert cause.probability > 0.9
    assert cause.indistinguishable_from == ()
    assert cause.parameters["amplitude"].value == pytest.approx(AMPLITUDE, rel=0.02)
    assert cause.parameters["order"].value == ORDER
