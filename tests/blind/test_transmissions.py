"""Cases with a second encoder: what it records, and which plays count as plays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.blind.transmissions import cases, without_joints
from drivetwin.blind.wide import record
from drivetwin.blind.wide.case import WideCase
from drivetwin.blind.wide.choice import choice
from drivetwin.blind.wide.draw import drawn_case, is_a_spring, world_of
from drivetwin.blind.wide.record import record_wide
from drivetwin.blind.wide.weighing import Recorded
from drivetwin.recording.reader import read_recording


@pytest.fixture(scope="module")
def case() -> WideCase:
    """An elasticity of a linear axis. An eccentric encoder of its motor would show between the two encoders as well."""
    found = next(cases(1, 5, ("linear",)))
    assert all(item.effect != "encoder_eccentricity" for item in found.nuisances)
    return found


def test_the_second_encoder_sees_the_spring_of_the_case(
    case: WideCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the axis hardly accelerates, the joint is behind its motor by the drive's torque over the stiffness."""
    world = world_of(case, None)
    monkeypatch.setattr(record, "world_of", lambda *_: replace(world, plans=world.plans[:1]))
    (cause,) = case.causes
    assert cause.effect == "elasticity"
    record_wide(case, tmp_path / "case", second_encoder=True)
    (recording,) = read_recording(tmp_path / "case/train_1")
    columns = recording.columns[cause.axis]
    window = max(1, round(0.05 / recording.info.sample_period))
    slow = np.ones(window) / window
    ahead = np.convolve(columns["joint_position"] - columns["position"], slow, "valid")
    torque = np.convolve(columns["torque"], slow, "valid")
    gives = -np.polyfit(torque, ahead, 1)[0] * cause.parameters["stiffness"]
    assert 0.4 < gives < 1.1, "all of the torque but the motor's own share of the inertia"
    assert np.corrcoef(torque, ahead)[0, 1] < -0.9
    assert "joint_position" not in without_joints(recording).columns[cause.axis]
    record_wide(case, tmp_path / "plain")
    (plain,) = read_recording(tmp_path / "plain/train_1")
    np.testing.assert_array_equal(plain.columns[cause.axis]["torque"], columns["torque"])
    assert "joint_position" not in plain.columns[cause.axis]


def test_a_play_smaller_than_its_flanks_give_is_a_spring(case: WideCase) -> None:
    (cause,) = case.causes
    level = case.levels[cause.axis]
    for gap, spring in ((0.5 * level.torque / 1000.0, True), (2.0 * level.torque / 1000.0, False)):
        play = replace(cause, effect="backlash", parameters={"gap": gap, "stiffness": 1000.0, "damping": 1.0})
        assert is_a_spring(play, level, 1.5 * gap) is spring
        assert is_a_spring(play, level, 0.9 * gap), "the load never leaves its flank"
    assert not is_a_spring(cause, level, 0.0)


def test_a_joint_strays_by_what_its_spring_gives(case: WideCase) -> None:
    """By this a play is told that a weight holds on one flank: there the joint strays by less than the gap."""
    world, (cause,) = world_of(case, None), case.causes
    plan, k = world.plans[0], world.names.index(cause.axis)
    run = world.moved(case.causes, plan)
    strays = Recorded.of(world, case.causes, run, plan).strays[k]
    assert 0.3 < strays * cause.parameters["stiffness"] / np.ptp(run.given[:, k]) < 1.2


def test_no_play_that_is_drawn_is_a_spring() -> None:
    """The first machine of this seed has flanks that give way by more than its play: the case is drawn again."""
    case = drawn_case(0, 3, "single", ("backlash",), choice(("rotary", "linear", "backlash")))
    assert case.attempt > 0
    assert not is_a_spring(case.causes[0], case.levels[case.causes[0].axis], np.inf)
