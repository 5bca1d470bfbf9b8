"""The drive's surroundings: switches, probe inputs, supply, safety, encoder; a test bench may disturb them."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.machine import Axis as MachineAxis

Angles = NDArray[np.float64]


@dataclass(frozen=True)
class Switch:
    """An input that is actuated while the motor angle is within `low`..`high` [rad]."""

    low: float
    high: float

    def actuated(self, angle: float) -> bool:
        """Whether it is actuated at a motor angle [rad]."""
        return self.low <= angle <= self.high

    def readings(self, angles: Angles) -> NDArray[np.bool_]:
        """The input at motor angles (n,) [rad]."""
        return np.asarray((self.low <= angles) & (angles <= self.high))


NEVER = Switch(inf, -inf)
"""An input that nothing is wired to, or a broken wire."""
ALWAYS = Switch(-inf, inf)
"""An input that is stuck."""


@dataclass(frozen=True)
class LimitSwitches:
    """The negative limit switch is actuated up to `low`, the positive from `high` on; motor angles [rad]."""

    low: float
    high: float

    def negative(self, angle: float) -> bool:
        """Whether the negative switch is actuated at `angle`."""
        return angle <= self.low

    def positive(self, angle: float) -> bool:
        """Whether the positive switch is actuated at `angle`."""
        return angle >= self.high


@dataclass
class Hardware:
    """The state of the hardware, for a bench to read and to disturb while the drive runs.

    `sto`: safe torque off is requested. `encoder_alive`: signals come from the encoder. `dc_link_voltage` [V], nominal until
    disturbed. `current_scale`: what the current trip sees per true current, more than 1 is a shorted winding.
    `switches`, `home_switch` and `probes` (touch probe 1 and 2) may be replaced, by NEVER and ALWAYS too.
    """

    nominal_voltage: float
    switches: LimitSwitches
    home_switch: Switch | None
    index_angle: float
    dc_link_voltage: float
    sto: bool = False
    encoder_alive: bool = True
    current_scale: float = 1.0
    probes: list[Switch] = field(default_factory=lambda: [NEVER, NEVER])

    @classmethod
    def of(cls, axis: MachineAxis) -> Hardware:
        """The undisturbed hardware of a machine's axis."""
        gear, limits, home = axis.gear_ratio, axis.limit_switches, axis.home_switch
        return cls(
            nominal_voltage=axis.motor.dc_link_voltage,
            switches=LimitSwitches(limits.negative * gear, limits.positive * gear),
            home_switch=None if home is None else Switch(home.negative * gear, home.positive * gear),
            index_angle=axis.encoder.index_angle,
            dc_link_voltage=axis.motor.dc_link_voltage,
        )

    def index_pulses(self, angles: Angles) -> NDArray[np.bool_]:
        """Whether an index pulse was passed between successive motor angles (n,) [rad]: (n - 1,)."""
        turns = np.floor((angles - self.index_angle) / (2.0 * pi))
        return np.asarray(np.diff(turns) != 0.0)
