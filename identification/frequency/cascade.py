"""A drive's loops as they act on a frequency: PI, speed filter, current lag, and torques that are held between samples.

The drive works at its servo period Ts, the bus at the cycle T. z = exp(jωTs). All on the joint's side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.identification.frequency.phasors import Complex
from drivetwin.recording.recording import DriveLaw, DriveLoops, Samples

USUAL_SERVO_PERIOD = 125e-6
"""Where a drive does not tell its own [s]."""


@dataclass(frozen=True)
class Cascade:
    """P position loop over a PI velocity loop. `position_gain` [1/s], `velocity_gain` [N·m·s/rad or N·s/m], `integral_time` [s]
    (None: a P loop), `velocity_filter` and `current_lag` [s] of first order, `servo_period` [s]."""

    position_gain: float
    velocity_gain: float
    integral_time: float | None
    velocity_filter: float
    current_lag: float
    servo_period: float

    def speed(self, frequency: Samples) -> Complex:
        """Measured speed for a unit of position (m,): difference of the count and first-order filter."""
        return np.asarray(self._lag(frequency, self.velocity_filter) * (1.0 - self._back(frequency)) / self.servo_period)

    def proportional_integral(self, frequency: Samples) -> Complex:
        """Torque demand for a unit of speed error (m,)."""
        if self.integral_time is None:
            return np.full(len(frequency), self.velocity_gain, dtype=np.complex128)
        back = self._back(frequency)
        return np.asarray(self.velocity_gain * (1.0 + self.servo_period / self.integral_time * back / (1.0 - back)))

    def current(self, frequency: Samples) -> Complex:
        """Torque for a unit of demand (m,)."""
        return self._lag(frequency, self.current_lag)

    def held(self, frequency: Samples) -> Complex:
        """What holding a torque for a servo period does to it (m,)."""
        return hold(frequency, self.servo_period)

    def settled(self, frequency: Samples, cycle: float) -> Complex:
        """Sampled torque at the end of a `cycle` [s] for a unit that is injected in steps of a cycle (m,): a cycle old."""
        left = np.exp(-cycle / self.current_lag) if self.current_lag > 0.0 else 0.0
        back = np.exp(-2j * np.pi * frequency * cycle)
        return np.asarray(back * (1.0 - left) / (1.0 - left * back))

    def with_lag(self, lag: float) -> Cascade:
        """The same with another current loop."""
        return replace(self, current_lag=lag)

    def _lag(self, frequency: Samples, time_constant: float) -> Complex:
        left = np.exp(-self.servo_period / time_constant) if time_constant > 0.0 else 0.0
        return np.asarray((1.0 - left) / (1.0 - left * self._back(frequency)))

    def _back(self, frequency: Samples) -> Complex:
        return np.asarray(np.exp(-2j * np.pi * frequency * self.servo_period))


def hold(frequency: Samples, period: float) -> Complex:
    """Zero-order hold of `period` [s] (m,) (Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998, 5.3)."""
    return np.asarray(np.exp(-1j * np.pi * frequency * period) * np.sinc(frequency * period))


def cascade_of(axis: str, loops: DriveLoops | None) -> Cascade:
    """What a drive told of its loops. Raises UserError where it is no cascade, or does not tell its gains."""
    if loops is None or loops.law is not DriveLaw.CASCADE or loops.position_gain is None or not loops.velocity_gain:
        raise UserError(
            f"axis {axis}: its drive has no gains of a position loop over a velocity loop, so their frequency responses "
            "cannot be separated; this needs a drive type with position_gain and velocity_gain (servoone, cia402-full)"
        )
    cutoff = loops.velocity_filter_hz
    return Cascade(
        loops.position_gain,
        loops.velocity_gain,
        loops.integral_time or None,
        1.0 / (2.0 * np.pi * cutoff) if cutoff else 0.0,
        loops.current_loop_time_constant or 0.0,
        loops.servo_period or USUAL_SERVO_PERIOD,
    )
