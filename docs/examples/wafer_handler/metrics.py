"""How well a move was followed: settling and deceleration time as defined in the paper, and the largest error."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.feedforward.rest import LEAD_IN, rows_of
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Recording
from wafer_handler.leg import Leg

BAND = 0.05
"""Half width of the band, as a share of the baseline's greatest tracking difference."""

_CRUISE_TAIL = 1.0 / 3.0
"""Last share of the cruise whose mean is the cruise value."""

Error = NDArray[np.float64]


@dataclass(frozen=True)
class Tracking:
    """One axis in a leg: `time` (n,) [s] from the start of the demand, `error` (n,) demand - actual [m or rad].

    The cruise lasts from `cruise_start` to `cruise_end` [s]; then the demand decelerates.
    """

    time: Error
    error: Error
    cruise_start: float
    cruise_end: float

    @property
    def peak(self) -> float:
        """Greatest tracking difference [m or rad]."""
        return float(np.abs(self.error).max())

    def settling_time(self, baseline_peak: float) -> float:
        """Seconds from the start until the difference stays within the band around its cruise value, to the cruise's end.

        0 where it never leaves the band, infinite where it has not come back by then.
        """
        cruising = (self.time >= self.cruise_end - _CRUISE_TAIL * (self.cruise_end - self.cruise_start)) & self._before_braking
        around = self.error - float(np.mean(self.error[cruising]))
        return self._settled(around, self._before_braking, baseline_peak)

    def deceleration_time(self, baseline_peak: float) -> float:
        """Seconds from the start of deceleration until the difference stays within the band around zero.

        0 where it never leaves the band, infinite where it has not come back by the end of the recording.
        """
        return max(0.0, self._settled(self.error, ~self._before_braking, baseline_peak) - self.cruise_end)

    @property
    def _before_braking(self) -> NDArray[np.bool_]:
        return np.asarray((self.time >= 0.0) & (self.time < self.cruise_end))

    def _settled(self, error: Error, considered: NDArray[np.bool_], baseline_peak: float) -> float:
        """Time after the last of the considered samples that is outside the band [s]."""
        outside = considered & (np.abs(error) > BAND * baseline_peak)
        if not outside.any():
            return 0.0
        within = np.flatnonzero(considered & (np.arange(len(error)) > np.flatnonzero(outside)[-1]))
        return float(self.time[within[0]]) if len(within) else inf


def tracking(recording: Recording, axis: str, leg: Leg, setpoint_delay: int) -> Tracking:
    """The tracking difference in a recording of `leg`; the demand starts `setpoint_delay` cycles after its set-points.

    Raises UserError for a leg that never cruises: there is no cruise value to settle at.
    """
    if leg.profile.cruise_time < 3.0 * recording.info.sample_period:
        raise UserError(f"the move of {axis} has no cruise: let it go further, or more slowly")
    period = recording.info.sample_period
    columns = recording.columns[axis]
    start = rows_of(LEAD_IN, period) - 1 + setpoint_delay
    rows = np.arange(start, len(recording.time))
    return Tracking(
        time=np.asarray((rows - start) * period, dtype=np.float64),
        error=columns["position_demand"][rows] - columns["position"][rows],
        cruise_start=leg.profile.ramp_time,
        cruise_end=leg.profile.ramp_time + leg.profile.cruise_time,
    )
