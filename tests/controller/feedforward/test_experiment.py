"""Offsets of the experiment on virtual drives without friction: what the stages leave of the tracking difference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from streaming_bench import EACH_MILLISECOND, StreamingBench, streaming
from wafer_handler.bench import true_base
from wafer_handler.experiment import run_stage
from wafer_handler.leg import Leg, leg
from wafer_handler.metrics import tracking
from wafer_handler.scara.dynamics import torque

from drivetwin.controller.feedforward.alignment import loops_of
from drivetwin.controller.feedforward.bench import Bench
from drivetwin.controller.feedforward.stage import Stage
from drivetwin.controller.joint_path import JointPath, Rows, limits_of
from drivetwin.controller.session import Streaming

BY_OFFSET = Streaming(period=0.002, velocity_offset=True)
ROTATE = 1


def rigid(path: JointPath) -> Rows:
    """The plant's own torque: whatever is left is a matter of time."""
    return torque(true_base(), path.position, path.velocity, path.acceleration)


def turn(bench: StreamingBench) -> Leg:
    axes = bench.session.machine.axes
    return leg(np.array([axis.rest for axis in axes.values()]), ROTATE, 1.3, limits_of(axes["rotate"]))


@pytest.mark.parametrize(("profile", "how"), [("servoone", EACH_MILLISECOND), ("cia402-full", BY_OFFSET)])
def test_exact_torque_leaves_next_to_nothing(profile: str, how: Streaming, tmp_path: Path) -> None:
    """Against lag a / Kp, which the late speed would leave: half a servo period of misalignment is a tenth of that, 30 urad."""
    with streaming("scara", profile, (), tmp_path / "bus.log", how) as bench:
        experiment = Bench(bench.session, loops_of(bench.session.drives, bench.session.axes), rigid)
        move = turn(bench)
        peaks = {}
        for stage in Stage:
            recording = run_stage(experiment, stage.value, move, stage)
            peaks[stage] = tracking(recording, "rotate", move, experiment.loops[ROTATE].setpoint_delay).peak
        here = [drive.position * drive.unit for drive in bench.session.drives]
        speed, gain = move.profile.peak_speed, experiment.loops[ROTATE].position_gain
        lag = experiment.loops[ROTATE].velocity_lag
    assert here == pytest.approx([axis.rest for axis in bench.session.machine.axes.values()], abs=1e-4)
    assert peaks[Stage.NONE] > 0.9 * speed / gain
    assert peaks[Stage.VELOCITY] < 0.1 * peaks[Stage.NONE]
    assert peaks[Stage.TORQUE] < 0.03 * lag * move.profile.peak_acceleration / gain
