"""An encoder disc that is not centred on its shaft: the reading errs once a motor turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import ANGLE, POSITION, Exciting, Look, Need, Parameter, PartEffect, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.waves import amplitude_and_phase


@dataclass(frozen=True)
class EncoderEccentricity(PartEffect):
    """Reading = position + amplitude sin(motor angle + phase), on the joint side; on the motor's, gear ratio times that.

    A disc of radius r that sits e off errs by e / r on the motor's shaft: HEIDENHAIN, Rotary Encoders, accuracy.
    """

    name: ClassVar[str] = "encoder_eccentricity"
    family: ClassVar[str] = "sensing and timing"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ABSOLUTE_POSITION, Need.ACCELERATION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.WHOLE_TRAVEL})
    by_motion: ClassVar[str] = "constant velocities at which a motor turn passes at several frequencies"
    by_sensor: ClassVar[str] = "a second encoder on the motor shaft"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.WAVE})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", POSITION, low=0.0),
        Parameter("phase", ANGLE),
    )

    amplitude: float
    phase: float = 0.0

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, encoder=replace(axis.encoder, eccentricity=self.amplitude, phase=self.phase))

    def repeats(self, axis: AxisDynamics) -> float:
        return 2.0 * pi / axis.gear_ratio

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        return super().sizes(motion, axis) | {"phase": 1.0}

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        """What it costs is linear in a small error."""
        small = 0.01 / axis.gear_ratio

        def compose(found: Sequence[float]) -> EncoderEccentricity:
            amplitude, phase = amplitude_and_phase(found)
            return cls(small * amplitude, phase)

        return [Start((cls(small), cls(small, 0.5 * pi)), compose)]

    @classmethod
    def drawn(cls, ground: Ground) -> EncoderEccentricity:
        wave = ground.wave(1.0)
        followed = 1.0 / np.sqrt(1.0 + (wave / ground.bandwidth) ** 2)
        return cls(sqrt(2.0) * ground.size(ground.inertia * wave**2 * followed), ground.phase())
