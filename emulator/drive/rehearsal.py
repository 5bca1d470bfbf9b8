"""Compiles what the modes fill a demand with: at its first use that takes up to seconds, in which a bus would get no answer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.interpolation import COURSE, fill_demands
from drivetwin.emulator.drive.profile_generator import sample_segments
from drivetwin.emulator.drive.ramp import approach, ramp_cycle
from drivetwin.emulator.drive.servo import VELOCITY


def rehearse(demand: NDArray[np.float64]) -> None:
    """Call each function once on a `demand` (n, 4) that lies in memory as those of the modes do; it is zero afterwards."""
    fill_demands(np.zeros(1, dtype=COURSE), demand[:, np.newaxis], 0.0)
    ramp_cycle(0.0, 0.0, 0.0, 0.0, 0.0, demand)
    approach(0.0, 0.0, 0.0, demand[:, VELOCITY])
    sample_segments(np.zeros((1, 5)), 0.0, 0.0, 0.0, demand)
    demand[:] = 0.0
