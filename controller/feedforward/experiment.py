"""The experiment on the drives: the same move with more and more fed forward, and again with what was learned."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from controller.feedforward.alignment import Loops, aligned, aligned_velocity, loop_reaction
from controller.feedforward.learning import Learner
from controller.feedforward.leg import Leg
from controller.feedforward.stage import Stage, velocity_fed_forward
from controller.feedforward.standing import held_torque
from controller.joint_path import JointPath, Rows
from controller.motion import Offsets
from controller.session import Session
from drivetwin.recording.recording import Recording

TorqueModel = Callable[[JointPath], Rows]
"""Joint torque (n, axes) [N·m or N] that a path (n, axes) needs, friction included."""


@dataclass(frozen=True)
class Bench:
    """Drives that stream, what their loops are, and the torque that the identified model says they need."""

    session: Session
    loops: Sequence[Loops]
    model: TorqueModel

    def run(self, name: str, path: JointPath, stage: Stage) -> Recording:
        """Stream a path that begins at rest where the axes are, at a stage, and record it."""
        return self.session.run(name, path.position, self.offsets(path, stage))

    def offsets(self, path: JointPath, stage: Stage) -> Offsets:
        """What a stage sends beside a path that begins where the axes stand; with torque they stand for `HOLD` before it."""
        torque = Offsets(np.zeros_like(path.position))
        if stage is Stage.TORQUE:
            needed = self.model(path)
            if not self.sends_velocity:
                needed = needed - loop_reaction(path, self.loops)
            torque = aligned(path, needed, self.loops, held_torque(self.session, self.loops))
        if stage.velocity and self.sends_velocity:
            return replace(torque, velocity=aligned_velocity(path, self.loops))
        return torque

    @property
    def sends_velocity(self) -> bool:
        """Whether the velocity is an offset of ours (60B1h), or the drives' own."""
        return all(drive.velocity_offset is not None for drive in self.session.drives)


def run_stage(bench: Bench, name: str, leg: Leg, stage: Stage) -> Recording:
    """There, back, and there again, which is recorded: by then the drive holds what every repetition starts from.

    Leaves the axis where the leg begins. Raises UserError as `Session.run`.
    """
    period = bench.session.cycle.period
    there, back = leg.sample(period), leg.back().sample(period)
    with velocity_fed_forward(bench.session.drives, stage.velocity):
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

    Yields the recording of each way there, the first one with nothing learned.
    """
    ways = [_way(bench, "", leg), _way(bench, " back", leg.back())]
    axis = bench.session.drives[leg.axis].name
    with velocity_fed_forward(bench.session.drives, True):
        for way in ways:
            bench.run(f"{name} run in{way.label}", way.path, Stage.TORQUE)
        for repetition in range(repetitions + 1):
            for way in ways:
                offsets = bench.offsets(way.path, Stage.TORQUE)
                offsets.torque[:, leg.axis] += way.learned
                recording = bench.session.run(f"{name} {repetition}{way.label}", way.path.position, offsets)
                if way is ways[0]:
                    yield recording
                columns = recording.columns[axis]
                way.learned = learner.next(way.learned, columns["position_demand"] - columns["position"], way.moving)


def _way(bench: Bench, label: str, leg: Leg) -> _Way:
    path = leg.sample(bench.session.cycle.period)
    late = bench.loops[leg.axis].setpoint_delay
    moving = np.concatenate([np.zeros(late, dtype=np.bool_), path.velocity[:-late, leg.axis] != 0.0])
    return _Way(label, path, moving, np.zeros(len(path.position)))
