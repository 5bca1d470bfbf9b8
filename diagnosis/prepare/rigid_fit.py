"""How well a motion explains a torque by the rigid body and plain friction: which of two readings of a motion is the better."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.channel import torque_of
from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.motion.filtering import effective_cutoff, fine_derivative, reach, zero_phase
from drivetwin.recording.recording import Recording

SAMPLES = 40_000
"""In the middle of a recording, by which two readings are compared."""
REACHES = 8
"""Of the comparison's filter, that a recording must last to be compared by."""


def tells(recording: Recording, cutoff_hz: float) -> bool:
    """Whether a recording is more than the edges of the filter."""
    period = recording.info.sample_period
    return len(recording.time) > REACHES * reach(period, effective_cutoff(period, cutoff_hz))


def left_by_rigid_body(simulation: Simulation, recording: Recording, axis: str, cutoff_hz: float) -> float:
    """Energy that inertia, weight, Coulomb and viscous friction leave of an axis's torque [(N·m)² or N²]."""
    left = rest_of_rigid_body(simulation, recording, axis, cutoff_hz)
    return float(left @ left)


def rest_of_rigid_body(simulation: Simulation, recording: Recording, axis: str, cutoff_hz: float) -> NDArray[np.float64]:
    """Torque (m,) that inertia, weight, Coulomb and viscous friction leave [N·m or N] of the middle of a recording, each by a
    factor of its own; torque and motion may differ a little in time.
    """
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    spare = max(len(recording.time) - SAMPLES, 0) // 2
    part = slice(spare, len(recording.time) - spare)
    kinematics = Kinematics.of(recording, simulation.axes, cutoff, part)
    rest, number = np.zeros_like(kinematics.position), simulation.axes.index(axis)
    weight = simulation.torques(Kinematics(kinematics.position, rest, rest))[:, number]
    moves = simulation.torques(kinematics)[:, number] - weight
    speed = kinematics.velocity[:, number]
    later = [fine_derivative(each, period, cutoff) for each in (moves, weight)]
    edge = reach(period, cutoff)
    columns = np.column_stack((moves, weight, *later, np.sign(speed), speed, np.ones_like(speed)))[edge:-edge]
    torque = zero_phase(torque_of(recording, axis)[part], period, cutoff)[edge:-edge]
    scaled = columns / np.maximum(np.abs(columns).max(axis=0), np.finfo(float).tiny)
    return np.asarray(torque - scaled @ np.linalg.lstsq(scaled, torque, rcond=None)[0])
