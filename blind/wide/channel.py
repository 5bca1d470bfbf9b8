"""What lies between an axis and the file: sampling, quanta, noise, a torque that comes late, relative positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.machines import Draw, Machine
from drivetwin.blind.wide.motion import SETTLE
from drivetwin.blind.wide.simulator import TICK

Array = NDArray[np.float64]

RATES = (50.0, 100.0, 125.0, 200.0, 250.0, 500.0, 1000.0, 1000.0, 1000.0, 2000.0, 4000.0, 5000.0)
"""Samples a second; one is drawn a recording."""


@dataclass(frozen=True)
class Channel:
    """What is recorded of an axis: quanta of torque and position, noise of the torque (rms, as the quantum in N·m or N)."""

    torque_quantum: float
    torque_noise: float
    position_quantum: float
    velocity: bool
    tells_timing: bool


def draw_channel(draw: Draw, machine: Machine, axis: int, inertia: float) -> Channel:
    """Torque in steps of 0.05 to 2 % of rated, noise of 0.02 to 0.5 %; a motor encoder of 12 to 22 bits a turn.

    More bits where a velocity loop of 30 Hz around `inertia` would make more than 2 % of the rated torque of one step.
    """
    rated = machine.nominal[axis].rated_torque
    turn = 2.0 * pi / machine.limits[axis].gear_ratio
    noisy = inertia * 2.0 * pi * 30.0 * turn / TICK / (0.02 * rated)
    fewest = max(12, int(np.ceil(np.log2(max(noisy, 1.0)))))
    return Channel(
        torque_quantum=rated * float(np.exp(draw.uniform(np.log(5e-4), np.log(2e-2)))),
        torque_noise=rated * float(np.exp(draw.uniform(np.log(2e-4), np.log(5e-3)))),
        position_quantum=turn / 2.0 ** int(draw.integers(fewest, max(fewest, 20) + 3)),
        velocity=bool(draw.random() < 0.5),
        tells_timing=bool(draw.random() < 0.4),
    )


def late(items: Sequence[Cause]) -> float:
    """By how much [s] torque is recorded after the position of the same moment."""
    signs = {"torque_lag": 1.0, "out_of_step": -1.0}
    return sum(signs[item.effect] * item.parameters["delay"] for item in items if item.effect in signs)


def bandwidth(items: Sequence[Cause]) -> float | None:
    """Of the torque channel [Hz]; None where it is open."""
    widths = [item.parameters["bandwidth"] for item in items if item.effect == "torque_lowpass"]
    return min(widths) if widths else None


def passed(torque: Array, items: Sequence[Cause], tick: float = TICK) -> Array:
    """A torque (k,) at every `tick` as its channel passes it on: low-pass of first order, then shifted in time."""
    width = bandwidth(items)
    if width is not None:
        kept = float(np.exp(-2.0 * pi * width * tick))
        torque = np.asarray(signal.lfilter([1.0 - kept], [1.0, -kept], torque, zi=[kept * torque[0]])[0])
    ticks = np.arange(len(torque))
    return np.asarray(np.interp(ticks - late(items) / tick, ticks, torque))


def sample_times(count: int, rate: float) -> Array:
    """Moments (m,) [s] at which a recording of `count` servo periods is sampled; it begins when the axes have settled."""
    begin, end = 0.6 * SETTLE, (count - 1) * TICK
    return begin + np.arange(int((end - begin) * rate)) / rate


def sampled(values: Array, times: Array) -> Array:
    """A signal (k,) at every servo period, at `times` (m,)."""
    return np.asarray(np.interp(times, np.arange(len(values)) * TICK, values))


def quantised(values: Array, quantum: float) -> Array:
    """To the nearest step."""
    return np.asarray(quantum * np.round(values / quantum))
