"""What feeding forward and learning refuse, before an axis finds out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from streaming_bench import streaming
from wafer_handler.experiment import repeat_learning
from wafer_handler.learning import Learner
from wafer_handler.leg import leg
from wafer_handler.metrics import tracking
from wafer_handler.scara.arm import load_arm
from wafer_handler.scara.blade_path import Point, blade_line
from wafer_handler.scara.dynamics import BaseParameters
from wafer_handler.scara.torque_model import ArmTorque

from drivetwin.controller.feedforward.alignment import loops_of
from drivetwin.controller.feedforward.bench import Bench
from drivetwin.controller.joint_path import limits_of
from drivetwin.controller.motion import Offsets, positions_now, stream
from drivetwin.controller.session import Streaming
from drivetwin.foundation.errors import UserError
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.recording.recording import AxisInfo

WEIGHTLESS = BaseParameters(*[0.0] * 9)


def test_a_path_that_begins_elsewhere(tmp_path: Path) -> None:
    with streaming("scara", "servoone", (), tmp_path / "bus.log") as bench:
        session = bench.session
        standing = positions_now(session.drives)
        away = standing + np.array([0.0, 0.1, 0.0])
        with pytest.raises(UserError, match=r"'leap' begins at 0.1 on axis rotate \(node 2\), which stands at .* move it"):
            session.run("leap", np.repeat(away[None, :], 3, axis=0))
        assert bench.virtual.plant.joint_positions() == pytest.approx(standing, abs=1e-3)


@pytest.mark.parametrize("period", [0.0015, 0.0004])
def test_a_cycle_that_60c2h_cannot_hold(period: float) -> None:
    with pytest.raises(UserError, match="60C2h counts whole milliseconds"):
        Streaming(period)


def test_a_cycle_too_short_for_its_frames(tmp_path: Path) -> None:
    """Three axes with a velocity offset: 55 + 3 (135 + 95 + 135) bits on 1 Mbit/s, and 50 heartbeats a second of 65 bits."""
    how = Streaming(period=0.001, velocity_offset=True)
    assert how.bus_time(3) == pytest.approx(1.15e-3 + 50 * 65e-6 * 0.001)
    with pytest.raises(UserError, match=r"3 axes take 1.15 ms of 1 Mbit/s and the cycle has 1 ms"), streaming(
        "scara", "servoone", (), tmp_path / "bus.log", how
    ):
        raise AssertionError("no session may open")


def test_velocities_to_a_drive_that_maps_none(tmp_path: Path) -> None:
    with streaming("stage", "servoone", (), tmp_path / "bus.log") as bench:
        drives = bench.session.drives
        standing = np.repeat(positions_now(drives)[None, :], 3, axis=0)
        with pytest.raises(UserError, match="maps no velocity offset"):
            stream(bench.session.cycle, drives, standing, Offsets(np.zeros((3, 1)), np.zeros((3, 1))))


def test_loops_that_are_not_told(tmp_path: Path) -> None:
    said = r"axis slide \(node 1\) does not give position_gain, velocity_gain"
    with streaming("stage", "servoone", (), tmp_path / "bus.log") as bench, pytest.raises(UserError, match=said):
        loops_of(bench.session.drives, {"slide": AxisInfo(joint="slide")})


def test_a_quantity_that_the_drive_type_has_not(tmp_path: Path) -> None:
    said = "drives of type servoone have no cogging to set"
    with streaming("stage", "servoone", (), tmp_path / "bus.log") as bench, pytest.raises(UserError, match=said):
        bench.session.set_parameter("cogging", 1.0)


def test_a_leg_without_a_cruise(tmp_path: Path) -> None:
    with streaming("stage", "servoone", (), tmp_path / "bus.log") as bench:
        axis = bench.session.machine.axes["slide"]
        short = leg(np.array([axis.rest]), 0, axis.rest + 1e-3, limits_of(axis))
        recording = bench.session.run("short", short.sample(0.001).position)
    with pytest.raises(UserError, match="has no cruise"):
        tracking(recording, "slide", short, 2)


def test_learning_that_makes_it_worse_is_stopped(tmp_path: Path) -> None:
    """A learner that takes the loops for ten times as stiff as they are."""
    with streaming("stage", "servoone", (), tmp_path / "bus.log") as bench:
        session = bench.session
        axis = session.machine.axes["slide"]
        loops = loops_of(session.drives, session.axes)
        way = leg(np.array([axis.rest]), 0, axis.rest + 0.08, limits_of(axis))
        wrong = replace(loops[0], velocity_gain=10.0 * loops[0].velocity_gain)
        experiment = Bench(session, loops, lambda path: np.zeros_like(path.position))
        with pytest.raises(UserError, match="times as far off as the first run; learning is stopped"):
            list(repeat_learning(experiment, "x", way, Learner(wrong, 1000.0, 0.001), 8))


def test_an_axis_that_only_rounding_moves_has_no_friction_to_feed() -> None:
    """A stretch line beside the x axis: rotate stands, its speed in the plan is rounding of either sign."""
    arm = load_arm()
    start, end = (Point(-reach * np.sin(0.9), reach * np.cos(0.9), 0.9) for reach in (0.35, 0.6))
    path = blade_line(arm, start, end, limits_of(arm.machine.axes["lift"]), 0.001).sample(0.001)
    assert 0.0 < np.abs(path.velocity[:, 1]).max() < 1e-9
    law = FrictionLaw(coulomb=2.0)
    told = ArmTorque(WEIGHTLESS, dict.fromkeys(("lift", "rotate", "stretch"), law))(path)
    assert (told[:, 1] == 0.0).all()
    assert (told[5:-5, 2] == 2.0).all()

