"""What recordings can be asked: of each motion, which effects are refused, why, and what would help."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import PERIOD, ready, recording

from drivetwin.diagnosis.prepare.testable import Testable
from drivetwin.diagnosis.report.result import Array
from drivetwin.emulator.effects import DriveEffect, library
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Recording

TIME = np.arange(round(15.0 / PERIOD), dtype=np.float64) * PERIOD
TO_AND_FRO = 0.6 * np.sin(1.7 * TIME) + 0.3 * np.sin(4.1 * TIME)
DEMAND = {name for name, kind in library().items() if issubclass(kind, DriveEffect)}
ALWAYS = DEMAND | {"temperature_drift"}
"""Of a column that stands upright, 15 s, whose drive is not told."""


def moved(position: Array, name: str = "strokes") -> Recording:
    """The column alone, its torque by inertia and friction."""
    velocity = np.gradient(position, PERIOD)
    torque = np.gradient(velocity, PERIOD) + 1.5 * np.sign(velocity) + 0.8 * velocity
    return recording({"turn": torque}, {"turn": position}, seed=3, name=name, noise=2.0)


def asked(folder: Path, *recordings: Recording) -> Testable:
    found = ready(folder, *recordings).testable["turn"]
    assert {kind.name for kind in found.kinds} | refused(found) <= set(library())
    assert not {kind.name for kind in found.kinds} & refused(found)
    return found


def refused(found: Testable) -> set[str]:
    return {one.effect for one in found.not_testable}


def why(found: Testable, effect: str) -> tuple[str, str]:
    return next((one.reason, one.needed) for one in found.not_testable if one.effect == effect)


def test_of_strokes_to_and_fro_every_effect_of_the_motion_can_be_asked(tmp_path: Path) -> None:
    found = asked(tmp_path, moved(TO_AND_FRO))
    assert refused(found) == ALWAYS
    assert why(found, "torque_saturation")[1] == "`position_demand`, and `drive` with its gains"


def test_of_one_direction_neither_asymmetries_nor_what_turns_round(tmp_path: Path) -> None:
    speed = 0.5 + 0.45 * np.sin(2.3 * TIME)
    found = asked(tmp_path, moved(np.cumsum(speed) * PERIOD))
    one_way = {"coulomb_asymmetry", "viscous_asymmetry", "torque_offset", "backlash", "presliding"}
    assert refused(found) == ALWAYS | one_way
    assert why(found, "coulomb_asymmetry") == ("motion in one direction only", "the same strokes in the other direction")
    assert why(found, "backlash") == ("no reversal of the motion", "strokes forth and back")


def test_of_an_axis_that_turns_on_and_on_what_turns_round_where_it_dwells(tmp_path: Path) -> None:
    """A cogging holds it back once a wave: a way of 0.1 rad among 20 rad one way."""
    speed = 1.3 + 2.0 * np.sin(8.0 * TIME)
    found = asked(tmp_path, moved(np.cumsum(speed) * PERIOD))
    assert not {"backlash", "presliding"} & refused(found)


def test_of_one_direction_a_play_where_a_second_encoder_shows_the_flanks(tmp_path: Path) -> None:
    """A load changes its flank where the axis brakes as well. Encoders that count alike show nothing."""
    one_way = moved(np.cumsum(0.5 + 0.45 * np.sin(2.3 * TIME)) * PERIOD)
    position = one_way.columns["turn"]["position"]
    on_a_flank = position - 1e-4 * np.sign(np.cos(2.3 * TIME))
    for joint, one_more in ((on_a_flank, False), (position, True)):
        turn = one_way.columns["turn"] | {"joint_position": joint}
        found = asked(tmp_path, replace(one_way, columns={"turn": turn}))
        assert ("backlash" in refused(found)) is one_more
        assert "presliding" in refused(found)


def trapezia(speed: float) -> Array:
    """To and fro at one speed, but for ramps of 30 ms."""
    velocity = np.clip(40.0 * speed * np.sin(2.0 * np.pi * 0.2 * TIME), -speed, speed)
    return np.cumsum(velocity) * PERIOD


def test_of_one_speed_no_law_of_speed(tmp_path: Path) -> None:
    found = asked(tmp_path, moved(trapezia(0.3)))
    assert refused(found) >= {"stribeck", "viscous", "viscous_nonlinear", "viscous_asymmetry"}
    assert why(found, "stribeck")[0] == "all motion at one speed"
    assert "delay" in refused(found), "a phase of what goes with the position"
    assert not refused(found) & {"coulomb", "coulomb_asymmetry", "torque_ripple", "position_friction", "torque_offset"}


def test_of_a_creeping_motion_nothing_of_inertia(tmp_path: Path) -> None:
    found = asked(tmp_path, moved(0.05 * np.sin(2.0 * np.pi * 0.1 * TIME)))
    assert refused(found) >= {"inertia", "delay", "elasticity", "torque_constant"}
    assert why(found, "inertia")[0] == "hardly any accelerations"
    assert not refused(found) & {"stribeck", "coulomb_asymmetry", "torque_ripple"}


PLACES = {"torque_ripple", "spring", "position_friction", "transmission_error", "encoder_eccentricity"}


@pytest.mark.parametrize("count", [1, 2])
def test_of_a_position_that_was_integrated_nothing_over_it_but_within_one_recording(tmp_path: Path, count: int) -> None:
    recordings = [moved(TO_AND_FRO, "one"), moved(0.9 * TO_AND_FRO[::-1], "two")][:count]
    derived = [replace(one, info=one.info.model_copy(update={"derived": ["turn.position"]})) for one in recordings]
    found = asked(tmp_path, *derived)
    assert refused(found) & PLACES == (PLACES if count == 2 else set())
    if count == 2:
        assert why(found, "spring")[0] == "the position is relative to where each recording began"


def test_of_recordings_that_begin_at_0_in_full_motion_the_position_is_relative(tmp_path: Path) -> None:
    recordings = [moved(speed * TO_AND_FRO, f"{speed}") for speed in (0.6, 0.8, 1.0)]
    assert refused(asked(tmp_path, *recordings)) & PLACES == PLACES
    elsewhere = [moved(speed * TO_AND_FRO + speed, f"{speed}") for speed in (0.6, 0.8, 1.0)]
    assert not refused(asked(tmp_path, *elsewhere)) & PLACES


def test_recordings_in_which_the_axis_stands_while_others_move_leave_its_position_absolute(tmp_path: Path) -> None:
    """A machine that is identified axis by axis: this one stands where it began, and its encoder flickers."""
    rng = np.random.default_rng(5)
    standing = [recording({"turn": 0.0 * TIME}, {"turn": 1e-7 * rng.standard_normal(len(TIME))}, name=f"{n}") for n in range(6)]
    moving = moved(0.6 - 0.6 * np.cos(1.7 * TIME))  # from rest, and from where the others stand
    assert not refused(asked(tmp_path, moving, *standing)) & PLACES


def test_a_drift_needs_time_that_is_told(tmp_path: Path) -> None:
    long = np.arange(round(25.0 / PERIOD), dtype=np.float64) * PERIOD
    whole = moved(0.6 * np.sin(1.7 * long))
    assert "temperature_drift" not in refused(asked(tmp_path, whole))
    later = replace(moved(0.8 * TO_AND_FRO + 0.1, "later"), time=TIME + 40.0)
    assert "temperature_drift" not in refused(asked(tmp_path, moved(TO_AND_FRO, "first"), later))
    assert "temperature_drift" in refused(asked(tmp_path, moved(TO_AND_FRO, "first"), moved(0.8 * TO_AND_FRO + 0.1, "again")))


def test_of_an_axis_that_never_moves_nothing_can_be_asked_and_a_line_says_so(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no axis moves") as told:
        ready(tmp_path, moved(np.full(len(TIME), 0.2)))
    assert "\n" not in str(told.value)
