"""The real encoder: the eccentricity of its disc on the shaft, and the delay of its reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.motion import Motion, Wave
from drivetwin.emulator.dynamics.place import Place
from drivetwin.emulator.dynamics.records import records
from drivetwin.foundation.compiled import in_place
from drivetwin.motion.earlier import earlier

STEPS = 10
"""Of Newton's method: an error of the disc bends a position by little."""


@dataclass(frozen=True)
class Encoder:
    """Reading = angle + gear eccentricity sin(angle + phase), `delay` [s] ago; angle of the motor [rad].

    `eccentricity` is on the joint side [rad or m].
    """

    eccentricity: float = 0.0
    phase: float = 0.0
    delay: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether it reads anything else than the angle now."""
        return self.eccentricity != 0.0 or self.delay > 0.0

    def truth(self, motion: Motion, gear: float) -> Motion:
        """The motion that is read as this one, but for the delay: position + error(position) = reading, and its derivatives.

        Of an error that passes faster than the samples, the acceleration is what the drive gives torque for.
        """
        if self.eccentricity == 0.0:
            return motion
        return motion.changed_lately(("read", self.eccentricity, self.phase, gear), lambda same: self._truth(same, gear))

    def _truth(self, motion: Motion, gear: float) -> Motion:
        position = motion.position
        for _ in range(3):
            angle = gear * position + self.phase
            slope = 1.0 + self.eccentricity * gear * np.cos(angle)
            position = position - (position + self.eccentricity * np.sin(angle) - motion.position) / slope
        velocity = motion.velocity / slope
        bend = self.eccentricity * gear**2 * motion.wave(angle, gear) * velocity**2
        acceleration = (motion.acceleration + bend) / slope
        torque = motion.rigid_torque + motion.inertia * (acceleration - motion.acceleration)
        torque = torque + motion.weight_slope * (position - motion.position)
        return replace(motion, position=position, velocity=velocity, acceleration=acceleration, rigid_torque=torque)

    def unknown(self, motion: Motion, truth: Motion, gear: float) -> NDArray[np.float64] | float:
        """Of the acceleration of the `truth` of a motion, what no recording shows: see `unseen`."""
        if self.eccentricity == 0.0 or motion.sampling is None:
            return 0.0
        angle = gear * truth.position + self.phase
        return np.asarray(self._bend(truth, gear) * (motion.wave(angle, gear) - motion.known_wave(angle, gear)))

    def unseen(self, motion: Motion, truth: Motion, gear: float) -> Wave | None:
        """The wave of the eccentricity in the acceleration of the `truth`, as far as no recording shows it; None: no wave."""
        wave = motion.unseen_wave(gear * truth.position + self.phase, gear) if self.eccentricity != 0.0 else None
        return None if wave is None else wave.times(self._bend(truth, gear))

    def _bend(self, truth: Motion, gear: float) -> NDArray[np.float64]:
        """Height (n,) of the wave that the eccentricity is in the acceleration of a motion."""
        slope = 1.0 + self.eccentricity * gear * np.cos(gear * truth.position + self.phase)
        return np.asarray(self.eccentricity * gear**2 * truth.velocity**2 / slope)

    def later(self, motion: Motion, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """Samples (n,) as they are `delay` after each: what is read now was then."""
        return earlier(samples, self.delay, motion.period)

    def later_steps(self, motion: Motion, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same of samples (n,) that jump, at which band-limited interpolation would ring; by straight lines."""
        number = np.arange(len(samples), dtype=np.float64)
        return np.interp(number + self.delay / motion.period, number, samples)

    def joint_at(self, reading: float, gear: float) -> float:
        """Where a joint stands [rad or m] that is read at `reading`, by Newton's method; `gear`: motor angle over joint."""
        joint = reading
        for _ in range(STEPS):
            angle = gear * joint + self.phase
            error = joint + self.eccentricity * sin(angle) - reading
            joint -= error / (1.0 + self.eccentricity * gear * cos(angle))
        return joint


@in_place
def read_encoders(encoders, delays, history, newest, angle, reading) -> None:  # type: ignore[no-untyped-def]
    """Readings (n,) of angles (n,), `delays` (rows,) periods late, by the rings `history` (rows, length) at `newest` (1,)."""
    for axis in range(angle.shape[0]):
        reading[axis] = angle[axis]
    length = history.shape[1]
    newest[0] = (newest[0] + 1) % length
    for row in range(encoders.shape[0]):
        encoder = encoders[row]
        history[row, newest[0]] = _seen(encoder, angle[encoder.axis])
        whole = int(delays[row])
        share = delays[row] - whole
        last, before = history[row, (newest[0] - whole) % length], history[row, (newest[0] - whole - 1) % length]
        reading[encoder.axis] = last + share * (before - last)


@in_place
def _seen(encoder, angle):  # type: ignore[no-untyped-def]
    return angle + encoder.gear * encoder.eccentricity * sin(angle + encoder.phase)


class Encoders:
    """The encoders that read anything else than the motor's angle now, at every `period` [s]; `arrays` for `read_encoders`."""

    def __init__(self, encoders: Sequence[tuple[Encoder, Place]], period: float, motor_angle: NDArray[np.float64]) -> None:
        """As having stood at motor angles (n,) [rad] for long."""
        rows = records((Encoder, Place), encoders)
        delays = np.asarray(rows["delay"] / period)
        length = int(delays.max(initial=0.0)) + 2
        standing = np.array([_seen(row, motor_angle[row["axis"]]) for row in rows], dtype=np.float64)
        history = np.repeat(standing[:, None], length, axis=1)
        self.arrays = (rows, delays, history, np.zeros(1, dtype=np.int64))
