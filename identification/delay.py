"""The delay between torque and position of a recording, which are not always sampled at the same instant.

A drive holds a set-point torque for a cycle, samples its current before its encoder, filters one and not the other. A
torque that stands a time d earlier in the recording than the motion it makes,

    tau(t) = tau_model(t + d) = tau_model(t) + d tau_model'(t) + O(d^2),

looks like less viscous friction, by inertia omega^2 d at the frequency omega: half a millisecond at 2 Hz on 1 kg·m² is
0.08 N·m·s/rad. The derivative of the fitted torque is one more column of the regression, and d its coefficient [s].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.identification.least_squares import solve
from drivetwin.identification.regressors import Design, Term
from drivetwin.motion.axis_motion import AxisMotion
from drivetwin.motion.filtering import derivative
from drivetwin.motion.moving import AxisSamples
from drivetwin.recording.recording import Samples


def with_delay(design: Design, samples: Sequence[AxisSamples]) -> Design:
    """`design` with the column of the delay, linearised at its own solution (one Gauss-Newton step)."""
    residual = solve(design).residual
    ends = np.cumsum([len(entry.motion.time) for entry in samples])[:-1]
    parts = np.split(residual, ends)
    columns = [delay_column(entry.motion, part) for entry, part in zip(samples, parts, strict=True)]
    return design.extend(Term.DELAY, np.concatenate(columns))


def delay_column(motion: AxisMotion, residual: Samples) -> Samples:
    """d tau / d delay (n,) [N·m/s or N/s]: the rate of the fitted torque, which is the measured one less `residual`."""
    return derivative(motion.torque - residual, motion.period)
