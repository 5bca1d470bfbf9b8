"""From a recording to what the regression works on: the filtered motion and torque of each axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from drivetwin.foundation.errors import UserError
from drivetwin.motion.filtering import derivative, effective_cutoff, reach, zero_phase
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.motion.spectrum import density
from drivetwin.recording.recording import Recording, Samples

_ON_GRID = 0.05
"""Of a quantum, that samples on its grid are off in the median."""
_ROUNDING = 64.0 * float(np.finfo(np.float64).eps)
"""Share of a position that filtering leaves as rounding: an axis that stands must not seem to move by it."""
STEADIED = "steadied_position"
"""Column of a position that is the integral of a recorded velocity above some frequency: its noise is the velocity's."""
SMOOTHED = "smoothed_position"
"""Column of a position less what of it is noise by its spectrum."""


@dataclass(frozen=True)
class AxisMotion:
    """One axis in one recording, all (n,), joint side, SI units.

    `position`, `velocity`, `acceleration`: of the filtered position; `torque`: measured, filtered; `model_torque`: what
    the frictionless model needs for this motion of all recorded axes. `velocity_noise` [rad/s or m/s] is the standard
    deviation that encoder noise leaves in `velocity`; `cutoff_hz` the filter that was used.
    """

    recording: str
    axis: str
    period: float
    cutoff_hz: float
    time: Samples
    position: Samples
    velocity: Samples
    acceleration: Samples
    torque: Samples
    model_torque: Samples
    velocity_noise: float

    def smooth(self, samples: Samples) -> Samples:
        """The filter that torque and position went through, for a regressor (n,)."""
        return zero_phase(samples, self.period, self.cutoff_hz)


def axis_motions(model: Model, recording: Recording, cutoff_hz: float) -> list[AxisMotion]:
    """Filter a recording and evaluate the model on it, one result for each recorded axis.

    Velocity and acceleration are central differences of the position filtered by `zero_phase`; the torque goes through
    the same filter. The model's torque is evaluated on the filtered motion: it is linear in the acceleration, and its
    other arguments are slow beside the cut-off, so that it needs no second pass.
    """
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    _refuse_short(recording, period, cutoff)
    axes = list(recording.info.axes)
    raw = [measured_position(recording.columns[axis], period) for axis in axes]
    position = np.column_stack([zero_phase(samples, period, cutoff) for samples in raw])
    velocity = np.column_stack([derivative(samples, period) for samples in position.T])
    acceleration = np.column_stack([derivative(samples, period) for samples in velocity.T])
    joints = [recording.info.axes[axis].joint for axis in axes]
    needed = model.torques(joints, position, velocity, acceleration)
    return [
        AxisMotion(
            recording=recording.name,
            axis=axis,
            period=period,
            cutoff_hz=cutoff,
            time=recording.time,
            position=position[:, k],
            velocity=velocity[:, k],
            acceleration=acceleration[:, k],
            torque=zero_phase(recording.columns[axis]["torque"], period, cutoff),
            model_torque=needed[:, k],
            velocity_noise=velocity_noise(recording, axis, raw[k], position[:, k], cutoff),
        )
        for k, axis in enumerate(axes)
    ]


def measured_position(columns: dict[str, Samples], period: float) -> Samples:
    """The position (n,) of an axis [rad or m]: as steadied or smoothed, else as counted, else the integral of its velocity."""
    for name in (STEADIED, SMOOTHED, "position"):
        if name in columns:
            return columns[name]
    return np.asarray(cumulative_trapezoid(columns["velocity"], dx=period, initial=0), dtype=np.float64)


def velocity_noise(recording: Recording, axis: str, raw: Samples, filtered: Samples, cutoff_hz: float) -> float:
    """Standard deviation of the filtered velocity that comes from measurement noise [rad/s or m/s].

    What the filter took away is noise of the share 1 - 2 fc T of the band. A measured position has white noise s_q:
    s_v = 2 pi fc s_q sqrt(2 fc T / 3). A position integrated from velocity has the white noise of the velocity:
    s_v = s_u sqrt(2 fc T).
    """
    period = recording.info.sample_period
    share = 2.0 * cutoff_hz * period
    info = recording.info.axes[axis]
    edge = reach(period, cutoff_hz)
    columns = recording.columns[axis]
    if SMOOTHED in columns:
        return _left_by_smoothing(columns["position"], columns[SMOOTHED], period)
    quantum = max(_quantum(raw, info.position_resolution) / np.sqrt(12.0), _ROUNDING * float(np.abs(raw).max()))
    if STEADIED in columns:
        lost = (columns["velocity"] - zero_phase(columns["velocity"], period, cutoff_hz))[edge:-edge]
        return float(np.std(lost) / np.sqrt(1.0 - share) * np.sqrt(share))
    if "position" not in columns or f"{axis}.position" in recording.info.derived:
        lost = derivative(raw - filtered, period)[edge:-edge]
        return float(np.std(lost) / np.sqrt(1.0 - share) * np.sqrt(share))
    lost = (raw - filtered)[edge:-edge]
    noise = max(float(np.std(lost)) / np.sqrt(1.0 - share), quantum)
    return float(2.0 * np.pi * cutoff_hz * noise * np.sqrt(share / 3.0))


def _left_by_smoothing(counted: Samples, smoothed: Samples, period: float) -> float:
    """Of white noise of a counted position, what a smoothing has left in the velocity [rad/s or m/s], by its own gain."""
    times, length = 4, min(512, len(counted) - 4)
    at, before = density(counted, period, times, length)
    _, after = density(smoothed, period, times, length)
    white = float(np.median(before[at >= 0.35 / period]))
    passed = np.minimum(after / np.maximum(before, np.finfo(float).tiny), 1.0)
    return float(np.sqrt(np.sum(white * passed * (2.0 * np.pi * at) ** 2) * at[0]))


def _quantum(raw: Samples, resolution: float | None) -> float:
    """The resolution, if the samples stand on its grid: an integrated or filtered position does not."""
    if not resolution:
        return 0.0
    steps = (raw - raw[0]) / resolution
    return resolution if float(np.median(np.abs(steps - np.round(steps)))) < _ON_GRID else 0.0


def least_samples(period: float, cutoff_hz: float) -> int:
    """Samples that the filter needs, for there to be some that its ends do not reach."""
    return 8 * reach(period, effective_cutoff(period, cutoff_hz))


def _refuse_short(recording: Recording, period: float, cutoff_hz: float) -> None:
    least = least_samples(period, cutoff_hz)
    if len(recording.time) < least:
        raise UserError(
            f"recording '{recording.name}' has {len(recording.time)} samples; the filter needs at least {least} "
            f"({least * period:.2g} s): record longer or raise the cut-off with --cutoff"
        )
