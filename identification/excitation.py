"""Does the motion contain anything that shows the inertia?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.motion.moving import AxisSamples

_LEAST_SHARE = 0.01


def speed_changes(samples: Sequence[AxisSamples]) -> bool:
    """Whether the velocity's variance within the recordings is at least 1 % of its mean square.

    Below that the axis ran at steady speeds: what acceleration there is, is ripple and noise, and a fit of the inertia
    to it would find the drive's own reaction to the ripple.
    """
    within = total = 0.0
    for entry in samples:
        velocity = entry.motion.velocity[entry.fitted]
        if len(velocity):
            within += entry.motion.period * float(np.sum((velocity - velocity.mean()) ** 2))
            total += entry.motion.period * float(velocity @ velocity)
    return within > _LEAST_SHARE * total
