"""The slow motion of a recording that lacks torques, and the loops that asked for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.motion.filtering import effective_cutoff, zero_phase
from drivetwin.recording.recording import TORQUE, Recording
from drivetwin.twin.asked import loops_by_position
from drivetwin.twin.loops import Loops

Array = NDArray[np.float64]

SLOW_HZ = 10.0
"""What loops hold and when they take a rate is told below it: there a log of 30 rows a second says as much as any."""
MOVING = 0.02
"""Share of the top speed from which friction has its sign."""


@dataclass(frozen=True)
class SlowMotion:
    """The slow motion of a recording and the rigid model's torque for it, each (m, k); `laws` of the axes without torque."""

    recording: Recording
    kinematics: Kinematics
    rigid: Array
    laws: Mapping[str, Loops]

    @classmethod
    def of(cls, simulation: Simulation, recording: Recording, model: mujoco.MjModel) -> SlowMotion:
        laws = {axis: loops_by_position(recording, axis, model) for axis in without_torque(recording)}
        period = recording.info.sample_period
        cutoff = effective_cutoff(period, SLOW_HZ)
        kinematics = Kinematics.of(recording, simulation.axes, cutoff).every(_every(recording))
        return cls(recording, kinematics, simulation.torques(kinematics), laws)

    def led(self, leads: Mapping[str, float]) -> SlowMotion:
        """With the demand's rate as early, where the recording does not say how early it is."""
        return replace(self, laws={axis: self.law(axis, leads[axis]) for axis in self.laws})

    def law(self, axis: str, lead: float) -> Loops:
        """The loops of an axis, their demand's rate by `lead` early [s] unless the recording tells it."""
        drive = self.recording.info.axes[axis].drive
        told = drive is not None and drive.velocity_feedforward_lead is not None
        return self.laws[axis] if told else replace(self.laws[axis], feedforward_lead=lead)

    def filtered(self, torque: Array) -> Array:
        """A torque (n,) of the recording as slow (m,)."""
        period = self.recording.info.sample_period
        return zero_phase(torque, period, effective_cutoff(period, SLOW_HZ))[:: _every(self.recording)]

    @property
    def period(self) -> float:
        """Of its rows [s]."""
        return _every(self.recording) * self.recording.info.sample_period

    def moving(self, k: int) -> NDArray[np.bool_]:
        """Where the k-th axis moves; everywhere where it never does."""
        speed = np.abs(self.kinematics.velocity[:, k])
        return np.asarray((speed > MOVING * speed.max(initial=0.0)) | (speed.max(initial=0.0) == 0.0))


def without_torque(recording: Recording) -> list[str]:
    """Axes whose torque was not recorded."""
    return [axis for axis, columns in recording.columns.items() if TORQUE not in columns]


def _every(recording: Recording) -> int:
    return max(1, int(1.0 / (8.0 * SLOW_HZ * recording.info.sample_period)))
