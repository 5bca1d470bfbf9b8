"""Mechanics, velocity loop and position loop of an axis over frequency, from its answer to an injected torque.

Injected torque d, feedback torque c, torque at the motor u = d + c: the open loop at the torque is d/u - 1, whatever the
mechanics; speed over u is the mechanics. Samples are those of the end of a cycle, the encoder's count one servo period old.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from drivetwin.identification.frequency.cascade import Cascade, hold
from drivetwin.identification.frequency.phasors import Complex, Response
from drivetwin.recording.recording import Samples

Mask = NDArray[np.bool_]

LONGEST_LAG = 0.003
"""Of a current loop [s]."""

SURE = 0.02
"""Relative standard deviation up to which a line is reliable: 0.17 dB and 1.1 degrees."""

FAIR = 0.1
"""The same for margins: far below a crossover the loop leaves little torque to measure, and its gain does not matter."""


@dataclass(frozen=True)
class Bode:
    """Of one axis (m,): `frequency` [Hz], `mechanics` [rad/s per N·m or m/s per N], open loops [1], `coherence` 0..1.

    `deviation` is the standard deviation of the mechanics, relative; where it is above `SURE`, nothing is concluded.
    `velocity` is cut open at the measured speed, `position` at the measured position with the velocity loop closed.
    `cascade` has the current loop's lag that was found.
    """

    frequency: Samples
    mechanics: Complex
    velocity: Complex
    position: Complex
    coherence: Samples
    deviation: Samples
    cascade: Cascade

    @property
    def sure(self) -> Mask:
        """Reliable lines (m,)."""
        return np.asarray(self.deviation <= SURE)

    @property
    def fair(self) -> Mask:
        """Lines that margins are taken from (m,)."""
        return np.asarray(self.deviation <= FAIR)

    @property
    def closed_velocity(self) -> Complex:
        """Measured speed for a unit of demanded speed (m,)."""
        return np.asarray(self.velocity / (1.0 + self.velocity))

    @property
    def closed_position(self) -> Complex:
        """Position for a unit of demanded position (m,), without velocity feed-forward."""
        return np.asarray(self.position / (1.0 + self.position))


def bode(answer: Response, told: Cascade, cycle: float) -> Bode:
    """Split what was measured at a communication `cycle` [s], with the loops as the drive told them.

    A current loop of which the drive tells nothing (lag 0) is found from the measured torque.
    """
    cascade = told if told.current_lag > 0.0 else told.with_lag(_current_lag(answer, told, cycle))
    frequency = answer.frequency
    alone = _injected(cascade, frequency, cycle)
    torque = (answer.torque - cascade.settled(frequency, cycle)) * cascade.held(frequency) + alone
    whole = alone / torque - 1.0
    speed = cascade.speed(frequency)
    velocity = whole * speed / (cascade.position_gain + speed)
    position = whole * cascade.position_gain / (cascade.position_gain + speed) / (1.0 + velocity)
    mechanics = 2j * np.pi * frequency * answer.position / (torque + _images(cascade, frequency, cycle))
    return Bode(frequency, mechanics, velocity, position, answer.coherence, answer.deviation, cascade)


def loops_over(mechanics: Complex, frequency: Samples, cascade: Cascade) -> tuple[Complex, Complex]:
    """Open velocity and position loop (m,) that other gains would give over the same mechanics."""
    angle = mechanics / (2j * np.pi * frequency)
    forward = angle * cascade.held(frequency) * cascade.current(frequency) * cascade.proportional_integral(frequency)
    velocity = forward * cascade.speed(frequency)
    return np.asarray(velocity), np.asarray(forward * cascade.position_gain / (1.0 + velocity))


def _injected(cascade: Cascade, frequency: Samples, cycle: float) -> Complex:
    """Torque at the motor for a unit that is injected (m,), without feedback; it begins a servo period after the count."""
    late = np.exp(-2j * np.pi * frequency * cascade.servo_period)
    return np.asarray(late * cascade.current(frequency) * hold(frequency, cycle))


def _images(cascade: Cascade, frequency: Samples, cycle: float) -> Complex:
    """Torque at a line (m,) that would move the axis as the line's images about the sample rate do, which are sampled with it.

    So far above the lines the axis is an inertia, which answers a torque as 1/f².
    """
    images = (frequency + side / cycle for side in (-1.0, 1.0))
    return np.asarray(sum((frequency / image) ** 2 * _injected(cascade, image, cycle) for image in images))


def _current_lag(answer: Response, told: Cascade, cycle: float) -> float:
    """Lag of the current loop [s] with which position and injected torque explain the measured torque best."""
    frequency, weight = answer.frequency, answer.coherence
    demand = told.proportional_integral(frequency) * (told.position_gain + told.speed(frequency)) * answer.position

    def misfit(lag: float) -> float:
        tried = told.with_lag(lag)
        left = answer.torque - tried.settled(frequency, cycle) + tried.current(frequency) * demand
        return float((weight * np.abs(left) ** 2).sum())

    return float(minimize_scalar(misfit, bounds=(0.0, LONGEST_LAG), method="bounded", options={"xatol": 1e-6}).x)
