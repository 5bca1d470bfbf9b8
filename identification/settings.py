"""What the user may choose about the least squares; all of it is written into the result under `settings`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Settings:
    """Choices of the identification.

    cutoff_hz: -3 dB frequency of one pass of the 4th-order Butterworth low-pass [Hz]; it runs forward and backward.
    standstill_velocity: speed above which an axis counts as moving, by axis [rad/s or m/s]; an axis that is not named
        gets 0.2 % of its greatest speed, or five times the noise of its velocity where that is more.
    reversal_margin: time left out of the fit on either side of a reversal [s]. With 0 the reversals count, as in the
        published EMPS figures; a machine that sticks for some milliseconds at each reversal needs more than that plus
        the filter's reach (about 0.02 s at 48 Hz), because the sign of the velocity is not its friction there. Around
        a standstill 1.5 times the filter's reach is always left out.
    estimate_delay: fit the time by which the torque precedes the motion in the recording as well (delay.py says why it
        matters). Off, as in the published EMPS figures, and for captures of drives that map torque and position of the
        same instant, as the emulated ones do: docs/identification.md has what it changes there, which is nothing.
    confidence: of the intervals, two-sided.
    stribeck_exponent: of exp(-(|v| / stribeck_velocity)^exponent), where the data cannot tell it.
    stribeck_exponent_bounds: the exponent is sought between these.
    stribeck_gain: share of the cross-validated residual energy that the Stribeck term must take away to be included.
    direction_gain: the same for the direction-dependent viscous friction to be called real.
    significance: p-value below which a term is significant.
    """

    cutoff_hz: float = 48.0
    standstill_velocity: Mapping[str, float] = field(default_factory=dict)
    reversal_margin: float = 0.0
    estimate_delay: bool = False
    confidence: float = 0.90
    stribeck_exponent: float = 2.0
    stribeck_exponent_bounds: tuple[float, float] = (0.5, 4.0)
    stribeck_gain: float = 0.10
    direction_gain: float = 0.10
    significance: float = 1e-4
