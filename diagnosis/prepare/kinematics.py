"""The motion of all axes of a recording, filtered and differentiated alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.motion.axis_motion import measured_position
from drivetwin.motion.filtering import fine_derivative, zero_phase
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]

WHOLE = slice(None)


@dataclass(frozen=True)
class Kinematics:
    """A motion of all axes: position, velocity, acceleration, each (n, k) in the order of the simulation's axes; SI."""

    position: Array
    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, recording: Recording, axes: Sequence[str], cutoff_hz: float, part: slice = WHOLE) -> Kinematics:
        """As it was measured, or a part of it, through the zero-phase filter; the derivatives are central differences."""
        period = recording.info.sample_period
        raw = [measured_position(recording.columns[axis], period)[part] for axis in axes]
        position = np.column_stack([zero_phase(samples, period, cutoff_hz) for samples in raw])
        velocity = np.column_stack([fine_derivative(samples, period, cutoff_hz) for samples in position.T])
        acceleration = np.column_stack([fine_derivative(samples, period, cutoff_hz) for samples in velocity.T])
        return cls(position, velocity, acceleration)

    @classmethod
    def joined(cls, parts: Sequence[Kinematics]) -> Kinematics:
        """Several, one after the other."""
        position, velocity, acceleration = (
            np.concatenate([getattr(each, name) for each in parts]) for name in ("position", "velocity", "acceleration")
        )
        return cls(position, velocity, acceleration)

    def part(self, span: slice) -> Kinematics:
        """Some samples in a row."""
        return Kinematics(self.position[span], self.velocity[span], self.acceleration[span])

    def every(self, stride: int) -> Kinematics:
        """Each stride-th sample."""
        return Kinematics(self.position[::stride], self.velocity[::stride], self.acceleration[::stride])
