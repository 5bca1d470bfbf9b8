"""When a motion is sampled: every cycle after its start, the last sample at its end or after."""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray


def sample_times(duration: float, period: float) -> NDArray[np.float64]:
    """Times period, 2 period, ... up to the first at or after `duration`."""
    return np.asarray(np.arange(1, ceil(duration / period) + 1) * period, dtype=np.float64)
