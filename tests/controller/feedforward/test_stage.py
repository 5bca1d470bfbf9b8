"""Feeding the velocity forward: what the drive's own parameter is meanwhile, looked at from inside, and afterwards."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from streaming_bench import streaming

from drivetwin.controller.feedforward.stage import Stage, feed_velocity
from drivetwin.controller.motion import positions_now
from drivetwin.controller.session import Streaming
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

OWN = {"servoone": (0x2177, 0), "cia402-full": (0x60F9, 3)}
"""P375 CON_SPEED feed-forward [%], and the full profile's 60F9h:03 [1]."""

FULL = {"servoone": 100.0, "cia402-full": 1.0}


def own(virtual: VirtualMachine, profile: str) -> list[float]:
    """The drives' parameters, from inside."""
    return [float(drive.dictionary[OWN[profile]].value) for drive in virtual.drives]


def in_the_loops(virtual: VirtualMachine) -> list[float]:
    """What the loops work with."""
    return [float(drive.axis.servo.parameters["velocity_feedforward"]) for drive in virtual.drives]


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
@pytest.mark.parametrize("on", [True, False])
def test_it_is_all_or_nothing_and_as_it_was_after_the_session(profile: str, on: bool, tmp_path: Path) -> None:
    with streaming("stage", profile, (), tmp_path / "bus.log") as bench:
        session, virtual = bench.session, bench.virtual
        before = 0.37 * FULL[profile]
        session.drives[0].write(before, *OWN[profile])
        for wanted in (on, not on, on):
            feed_velocity(session, wanted)
            assert own(virtual, profile) == [FULL[profile] if wanted else 0.0]
            session.cycle.run()
            assert in_the_loops(virtual) == [1.0 if wanted else 0.0]
    assert own(virtual, profile) == pytest.approx([before])


def test_what_is_recorded_says_what_the_loops_were(tmp_path: Path) -> None:
    with streaming("stage", "servoone", (), tmp_path / "bus.log") as bench:
        session = bench.session
        standing = np.repeat(positions_now(session.drives)[None, :], 5, axis=0)
        for on in (True, False):
            feed_velocity(session, on)
            loops = session.run("standing", standing).info.axes["slide"].drive
            assert loops is not None
            assert loops.velocity_feedforward == (1.0 if on else 0.0)


@pytest.mark.parametrize("thrown", [UserError("in the block"), KeyboardInterrupt()])
def test_a_session_that_fails_stops_first_and_then_puts_back(thrown: BaseException, tmp_path: Path) -> None:
    with pytest.raises(UserError), streaming("scara", "servoone", (), tmp_path / "bus.log") as bench:  # noqa: PT012
        for drive, percent in zip(bench.session.drives, (20.0, 40.0, 60.0), strict=True):
            drive.write(percent, *OWN["servoone"])
        feed_velocity(bench.session, True)
        assert own(bench.virtual, "servoone") == [100.0] * 3
        raise thrown
    assert own(bench.virtual, "servoone") == pytest.approx([20.0, 40.0, 60.0])
    frames = [line.split()[2] for line in (tmp_path / "bus.log").read_text(encoding="utf-8").splitlines()]
    stopped = max(at for at, frame in enumerate(frames) if frame.startswith("201#0200"))
    put_back = max(at for at, frame in enumerate(frames) if frame.startswith("601#23772100"))
    assert put_back > stopped


def test_a_drive_that_is_silent_at_the_end_does_not_keep_the_others_from_their_parameters(tmp_path: Path) -> None:
    with pytest.raises(UserError), streaming("scara", "servoone", (), tmp_path / "bus.log") as bench:  # noqa: PT012
        for drive, percent in zip(bench.session.drives, (20.0, 40.0, 60.0), strict=True):
            drive.write(percent, *OWN["servoone"])
        feed_velocity(bench.session, True)
        bench.virtual.wires[0].bus_off()
        raise UserError("in the block")
    assert own(bench.virtual, "servoone") == pytest.approx([100.0, 40.0, 60.0])


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
@pytest.mark.parametrize("on", [True, False])
def test_a_drive_that_is_sent_a_velocity_offset_adds_none_of_its_own(profile: str, on: bool, tmp_path: Path) -> None:
    """Or the speed would be there twice."""
    how = Streaming(period=0.002, velocity_offset=True)
    with streaming("stage", profile, (), tmp_path / "bus.log", how) as bench:
        before = own(bench.virtual, profile)
        feed_velocity(bench.session, on)
        assert own(bench.virtual, profile) == [0.0]
    assert own(bench.virtual, profile) == before


def test_the_paper_s_stages() -> None:
    assert [(stage, stage.velocity) for stage in Stage] == [
        (Stage.NONE, False),
        (Stage.VELOCITY, True),
        (Stage.TORQUE, True),
    ]
