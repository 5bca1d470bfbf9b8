"""The friction that is fitted, as a function of speed.

tau(v) = coulomb sign(v) + viscous v + offset
         + viscous_difference |v|                                                  direction-dependent fit only
         + static_rise sign(v) exp(-(|v| / stribeck_velocity)^exponent)            where the data demand it
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.recording.recording import Samples


@dataclass(frozen=True)
class FrictionLaw:
    """Units: N·m or N, N·m·s/rad or N·s/m, rad/s or m/s.

    `viscous_difference` is half the viscous coefficient forwards less half of that backwards; `static_rise` is what the
    static torque has above the Coulomb torque.
    """

    coulomb: float = 0.0
    viscous: float = 0.0
    offset: float = 0.0
    viscous_difference: float = 0.0
    static_rise: float = 0.0
    stribeck_velocity: float | None = None
    stribeck_exponent: float = 2.0

    def torque(self, velocity: Samples) -> Samples:
        """Friction torque, opposing the motion counted positive, at `velocity` (n,)."""
        speed, sign = np.abs(velocity), np.sign(velocity)
        torque = self.coulomb * sign + self.viscous * velocity + self.offset + self.viscous_difference * speed
        if self.stribeck_velocity is not None:
            torque = torque + self.static_rise * sign * stribeck_decay(speed, self.stribeck_velocity, self.stribeck_exponent)
        return np.asarray(torque, dtype=np.float64)

    def minimum_velocity(self, top_speed: float) -> float | None:
        """Speed of the least friction between 0 and `top_speed`, None where it falls all the way or never falls."""
        if self.stribeck_velocity is None:
            return None
        speed = np.linspace(top_speed * 1e-5, top_speed, 20001)
        at = int(np.argmin((self.torque(speed) - self.torque(-speed)) / 2.0))
        return float(speed[at]) if 0 < at < len(speed) - 1 else None


def stribeck_decay(speed: Samples, stribeck_velocity: float, exponent: float) -> Samples:
    """exp(-(|v| / stribeck_velocity)^exponent), (n,): 1 at rest, 0 at high speed."""
    return np.asarray(np.exp(-((speed / stribeck_velocity) ** exponent)), dtype=np.float64)
