"""Drives that stream a path with what is fed forward: the velocity, and the torque that the identified model needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.controller.feedforward.alignment import Loops, aligned, aligned_velocity, loop_reaction
from drivetwin.controller.feedforward.stage import Stage
from drivetwin.controller.feedforward.standing import held_torque
from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.controller.motion import Offsets
from drivetwin.controller.session import Session
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
            needed = self.session.meanwhile(lambda: self.model(path))
            if not self.sends_velocity:
                needed = needed - loop_reaction(path, self.loops)
            torque = aligned(path, needed, self.loops, held_torque(self.session, self.loops))
        if stage.velocity and self.sends_velocity:
            return replace(torque, velocity=aligned_velocity(path, self.loops))
        return torque

    @property
    def sends_velocity(self) -> bool:
        """Whether the velocity is an offset of ours (60B1h), or the drives' own."""
        return all(drive.takes_velocity_offset for drive in self.session.drives)
