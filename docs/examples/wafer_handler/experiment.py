"""The experiment on the drives: one move with increasing feed-forward, then repeated with what was learned."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.feedforward.bench import Bench
from drivetwin.controller.feedforward.stage import Stage, feed_velocity
from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Recording
from wafer_handler.learning import Learner
from wafer_handler.leg import Leg


def run_stage(bench: Bench, name: str, leg: Leg, stage: Stage) -> Recording:
    """There, back, and there again, which is recorded: by then the drive holds what every repetition starts from.

    Leaves the axis where the leg begins. Raises UserError as `Session.run`.
    """
    period = bench.session.cycle.period
    there, back = leg.sample(period), leg.back().sample(period)
    feed_velocity(bench.session, stage.velocity)
    bench.run(f"{name} run in", there, stage)
    bench.run(f"{name} back", back, stage)
    recording = bench.run(name, there, stage)
    bench.run(f"{name} back", back, stage)
    return recording


@dataclass
class _Way:
    """One way of a leg, at which SYNC its demand moves (n,), and the torque learned for it so far (n,) [N·m or N]."""

    label: str
    path: JointPath
    moving: NDArray[np.bool_]
    learned: Rows


def repeat_learning(bench: Bench, name: str, leg: Leg, learner: Learner, repetitions: int) -> Iterator[Recording]:
    """There and back with velocity and torque fed forward, `repetitions` times after a first, learning both ways.

    Yields the recording of each way there, the first one with nothing learned. Raises UserError where a run is `DIVERGED`
    times as far off as the first.
    """
    ways = [_way(bench, "", leg), _way(bench, " back", leg.back())]
    feed_velocity(bench.session, True)
    for way in ways:
        bench.run(f"{name} run in{way.label}", way.path, Stage.TORQUE)
    first: float | None = None
    for repetition in range(repetitions + 1):
        for way in ways:
            offsets = bench.offsets(way.path, Stage.TORQUE)
            torque = offsets.torque.copy()
            torque[:, leg.axis] += way.learned
            recording = bench.session.run(f"{name} {repetition}{way.label}", way.path.position, replace(offsets, torque=torque))
            error = _error(bench, recording, leg.axis)
            first = first or float(np.abs(error).max())
            _refuse_divergence(name, repetition, error, first)
            if way is ways[0]:
                yield recording
            way.learned = learner.next(way.learned, error, way.moving)


DIVERGED = 3.0
"""A run whose tracking difference is so many times the first one's has learned something wrong."""


def _refuse_divergence(name: str, repetition: int, error: Rows, first: float) -> None:
    peak = float(np.abs(error).max())
    if peak > DIVERGED * first:
        raise UserError(
            f"{name}: repetition {repetition} is {peak / first:.1f} times as far off as the first run; learning is stopped: "
            "learn up to a lower frequency, and check the inertia"
        )


def _error(bench: Bench, recording: Recording, axis: int) -> Rows:
    """Tracking difference (n,) at each SYNC [m or rad]."""
    columns = recording.columns[bench.session.drives[axis].name]
    return columns["position_demand"] - columns["position"]


def _way(bench: Bench, label: str, leg: Leg) -> _Way:
    path = leg.sample(bench.session.cycle.period)
    late = bench.loops[leg.axis].setpoint_delay
    moving = np.concatenate([np.zeros(late, dtype=np.bool_), path.velocity[:-late, leg.axis] != 0.0])
    return _Way(label, path, moving, np.zeros(len(path.position)))
