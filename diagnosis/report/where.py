"""Where in the motion the gap lies: its energy above noise, shared out over the regimes that a controls engineer thinks in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.report.result import Array, AxisPrediction, Mask, Prediction, Regime, RegimeName

REVERSAL, PRESLIDING, ACCELERATION, LOW_SPEED, HIGH_SPEED = range(5)
REGIMES: tuple[RegimeName, ...] = get_args(RegimeName)

REVERSAL_TIME = 0.05
PRESLIDING_SHARE = 0.01
LOW_SPEED_SHARE = 0.25


@dataclass(frozen=True)
class Bounds:
    """Where one regime ends: [s], [rad or m], [rad/s² or m/s²], [rad/s or m/s]; `top_*` are the largest in motion."""

    reversal_time: float
    displacement: float
    acceleration: float
    low_speed: float
    top_acceleration: float
    top_speed: float

    def interval(self, regime: str) -> Mapping[str, tuple[float, float]]:
        """Bounds of one regime by quantity; acceleration and speed are magnitudes."""
        return {
            "reversal": {"time": (-self.reversal_time, self.reversal_time)},
            "presliding": {"displacement": (0.0, self.displacement)},
            "acceleration": {"acceleration": (self.acceleration, self.top_acceleration)},
            "low_speed": {"velocity": (-self.low_speed, self.low_speed)},
            "high_speed": {"speed": (self.low_speed, self.top_speed)},
        }[regime]


def regimes(predictions: Sequence[Prediction], axis: str, noise_rms: float, standstill_velocity: float) -> tuple[Regime, ...]:
    """Share of the gap's energy above noise in each regime of the motion; contract gap-report/1, "where".

    A sample in motion counts in the first that fits: `reversal`, within 50 ms of a change of direction; `presliding`, within
    1 % of the travel of where the axis stood or turned; `acceleration`, above the rms of the acceleration in motion;
    `low_speed`, below a quarter of the top speed; `high_speed`. `noise_rms` [N·m or N] is taken off sample by sample.
    Recordings weigh by their duration. Shares are never negative and add up to 1; where no regime is above noise they are
    those of the time. None where the axis is never in motion.
    """
    if not any(prediction.axes[axis].used.any() for prediction in predictions):
        return ()
    bounds = find_bounds(predictions, axis)
    above, duration = _energies(predictions, axis, noise_rms, standstill_velocity, bounds)
    shares = _adding_up(above if above.any() else duration)
    return tuple(Regime(name, float(share), bounds.interval(name)) for name, share in zip(REGIMES, shares, strict=True))


def above_noise(predictions: Sequence[Prediction], axis: str, noise_rms: float, standstill_velocity: float) -> bool:
    """Whether the gap has energy above noise in any regime, so that shares of it mean something."""
    if not any(prediction.axes[axis].used.any() for prediction in predictions):
        return False
    bounds = find_bounds(predictions, axis)
    return bool(_energies(predictions, axis, noise_rms, standstill_velocity, bounds)[0].any())


def _energies(
    predictions: Sequence[Prediction], axis: str, noise_rms: float, standstill_velocity: float, bounds: Bounds
) -> tuple[Array, Array]:
    """Of each regime: the gap's energy above noise, not below 0 [(N·m)² s or N² s], and how long it lasts [s]."""
    energy, duration = np.zeros(len(REGIMES)), np.zeros(len(REGIMES))
    for prediction in predictions:
        found = prediction.axes[axis]
        regime = classify(found, prediction.time, bounds, standstill_velocity)[found.used]
        excess = (found.measured - found.before)[found.used] ** 2 - noise_rms**2
        energy += prediction.period * np.bincount(regime, excess, len(REGIMES))
        duration += prediction.period * np.bincount(regime, minlength=len(REGIMES))
    return np.maximum(energy, 0.0), duration


def find_bounds(predictions: Sequence[Prediction], axis: str) -> Bounds:
    """Bounds of the regimes, from the motion of all recordings together."""
    found = [prediction.axes[axis] for prediction in predictions]
    weight = np.concatenate([np.full(each.axes[axis].used.sum(), each.period) for each in predictions])
    position = np.concatenate([each.position[each.used] for each in found])
    speed = np.concatenate([np.abs(each.velocity[each.used]) for each in found])
    acceleration = np.concatenate([np.abs(each.acceleration[each.used]) for each in found])
    top_speed = float(speed.max())
    return Bounds(
        reversal_time=REVERSAL_TIME,
        displacement=PRESLIDING_SHARE * float(np.ptp(position)),
        acceleration=float(np.sqrt(np.average(acceleration**2, weights=weight))),
        low_speed=LOW_SPEED_SHARE * top_speed,
        top_acceleration=float(acceleration.max()),
        top_speed=top_speed,
    )


def classify(axis: AxisPrediction, time: Array, bounds: Bounds, standstill_velocity: float) -> NDArray[np.intp]:
    """Regime of every sample (n,), as an index of REGIMES."""
    moving = np.abs(axis.velocity) > standstill_velocity
    turns = _turns(axis.velocity, moving)
    regime = np.where(np.abs(axis.velocity) <= bounds.low_speed, LOW_SPEED, HIGH_SPEED)
    regime[np.abs(axis.acceleration) > bounds.acceleration] = ACCELERATION
    regime[_displacement(axis.position, ~moving | _at(turns, len(time))) <= bounds.displacement] = PRESLIDING
    regime[_near(time, turns, bounds.reversal_time)] = REVERSAL
    return regime


def _turns(velocity: Array, moving: Mask) -> NDArray[np.intp]:
    """Samples at which the direction changes: halfway between two samples in motion of opposite sign."""
    at = np.flatnonzero(moving)
    last = np.flatnonzero(np.diff(np.sign(velocity[at])))
    return np.asarray((at[last] + at[last + 1]) // 2, dtype=np.intp)


def _at(samples: NDArray[np.intp], length: int) -> Mask:
    mask = np.zeros(length, dtype=np.bool_)
    mask[samples] = True
    return mask


def _displacement(position: Array, start: Mask) -> Array:
    """Distance (n,) from where the axis last stood or turned, or where the recording began."""
    last = np.maximum.accumulate(np.where(start, np.arange(len(position)), 0))
    return np.abs(position - position[last])


def _near(time: Array, turns: NDArray[np.intp], within: float) -> Mask:
    """Samples (n,) at most `within` [s] from a turn."""
    mask = np.zeros(len(time), dtype=np.bool_)
    for turn in turns:
        low, high = np.searchsorted(time, [time[turn] - within, time[turn] + within])
        mask[low:high] = True
    return mask


def _adding_up(amounts: Array) -> Array:
    """`amounts` as shares whose sum is 1 to the last bit that adding them up in order leaves."""
    shares = amounts / amounts.sum()
    largest = int(np.argmax(shares))
    shares[largest] += 1.0 - shares.sum()
    return np.asarray(shares, dtype=np.float64)
