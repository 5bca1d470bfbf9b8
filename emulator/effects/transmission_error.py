"""A gear whose ratio is not quite constant: teeth and wave generator that are not quite round."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log, pi, sqrt
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.replay import deflection, replayed
from drivetwin.emulator.effects.base import (
    ANGLE,
    JOINT_ENCODER,
    NUMBER,
    POSITION,
    Exciting,
    Look,
    Need,
    Parameter,
    ReplayedEffect,
    Start,
)
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.waves import FRACTIONAL, amplitude_and_phase, orders, turns_apart, unexplained

_SMALL = 0.02
_MOST = 0.9
"""Of amplitude order gear ratio, which is 1 where the gear would turn back."""


@dataclass(frozen=True)
class TransmissionError(ReplayedEffect):
    """q = motor angle / gear ratio + amplitude sin(order * motor angle + phase); rigid, or behind `elasticity`.

    `order` is in waves a motor turn, 2 for a strain wave gear, whose error goes with where its wave generator stands: Tuttle
    and Seering, IEEE Trans. Robotics and Automation 12(3), 1996. Torque and rotor inertia act by the ratio of the moment
    (virtual work).
    """

    name: ClassVar[str] = "transmission_error"
    family: ClassVar[str] = "transmission"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ABSOLUTE_POSITION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.WHOLE_TRAVEL})
    by_motion: ClassVar[str] = "constant velocities whose waves pass at several frequencies, with and without acceleration"
    by_sensor: ClassVar[str] = JOINT_ENCODER
    looks: ClassVar[frozenset[Look]] = frozenset({Look.WAVE})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", POSITION, low=0.0),
        Parameter("order", NUMBER, low=0.5),
        Parameter("phase", ANGLE),
    )

    amplitude: float
    order: float = 2.0
    phase: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return self._on(axis)

    def replay(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return replayed(motion, self._on(axis))

    def deflect(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        return deflection(motion, self._on(axis)) - deflection(motion, axis)

    def natural(self, axis: AxisDynamics) -> TransmissionError | None:
        """Slots, poles and teeth come in whole numbers a turn."""
        whole = max(1.0, float(round(self.order)))
        return replace(self, order=whole) if whole != self.order else None

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        return frozenset({"order"}) if self.order == round(self.order) else frozenset()

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """An order that is no whole number needs a gear ratio that is not the recording's."""
        return 0.0 if self.order == round(self.order) else log(FRACTIONAL)

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        return super().sizes(motion, axis) | {"order": turns_apart(motion, axis), "phase": 1.0}

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

    def _on(self, axis: AxisDynamics) -> AxisDynamics:
        error = {"error_amplitude": self.amplitude, "error_order": self.order, "error_phase": self.phase}
        return replace(axis, transmission=replace(axis.transmission, **error))
