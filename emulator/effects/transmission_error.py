"""A gear whose ratio is not quite constant: teeth and wave generator that are not quite round."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import ClassVar

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import ANGLE, NUMBER, POSITION, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.motor_wave import MotorWave
from drivetwin.emulator.effects.transmission_effect import TransmissionEffect
from drivetwin.emulator.effects.waves import amplitude_and_phase, orders, unexplained

_SMALL = 0.02
_MOST = 0.9
"""Of amplitude order gear ratio, which is 1 where the gear would turn back."""


@dataclass(frozen=True)
class TransmissionError(MotorWave, TransmissionEffect):
    """q = motor angle / gear ratio + amplitude sin(order * motor angle + phase); rigid, or behind `elasticity`.

    `order` is in waves a motor turn, 2 for a strain wave gear, whose error goes with where its wave generator stands: Tuttle
    and Seering, IEEE Trans. Robotics and Automation 12(3), 1996. Torque and rotor inertia act by the ratio of the moment
    (virtual work).
    """

    name: ClassVar[str] = "transmission_error"
    by_motion: ClassVar[str] = (
        "several constant velocities, at which the waves have different frequencies, with and without acceleration"
    )
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", POSITION, low=0.0),
        Parameter("order", NUMBER, low=0.5),
        Parameter("phase", ANGLE),
    )

    order: float = 2.0

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        """By the waves of its torque, or of what a second encoder sees."""
        seen = motion.deflection if motion.deflection is not None and motion.deflection.any() else unexplained(motion, axis)
        return [cls._start(order, order * axis.gear_ratio) for order in orders(motion, axis, seen)]

    @classmethod
    def drawn(cls, ground: Ground) -> TransmissionError:
        order = float(ground.draw.choice((1.0, 2.0)))
        amplitude = sqrt(2.0) * ground.size(ground.links * ground.wave(order) ** 2)
        return cls(min(amplitude, 0.3 / (order * ground.axis.gear_ratio)), order, ground.phase())

    @classmethod
    def _start(cls, order: float, wave: float) -> Start:
        """What it costs is linear in a small error."""
        small = _SMALL / wave

        def compose(found: Sequence[float]) -> TransmissionError:
            amplitude, phase = amplitude_and_phase(found)
            return cls(min(small * amplitude, _MOST / wave), order, phase)

        return Start((cls(small, order), cls(small, order, 0.5 * pi)), compose)

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        error = {"error_amplitude": self.amplitude, "error_order": self.order, "error_phase": self.phase}
        return replace(axis, transmission=replace(axis.transmission, **error))
