"""How accurate is the rest of the model? One scale on all its torque except friction and the inertia at qpos0.

    tau = inertia a + model_scale tau_rest + friction,    tau_rest = model torque - (inertia of the model at qpos0) a

tau_rest is gravity, Coriolis, springs and how the inertia changes with the pose. Masses that the drawings have 3 % low make
all of it 3 % low at once, and on an arm that folds the difference would go into `inertia` and out of its interval. The
scale is fitted where tau_rest is seen in the motion beside friction and inertia; constant gravity is an offset, and is not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.identification.least_squares import share_beside
from drivetwin.identification.regressors import Design, Term
from drivetwin.motion.axis_motion import AxisMotion
from drivetwin.motion.moving import AxisSamples
from drivetwin.recording.recording import Samples

_LEAST_SHARE = 0.02
"""Of its own norm that the column must keep beside the others."""
_LEAST_TORQUE = 0.01
"""And how much of the torque that is: below it, noise would find the scale."""


def with_model_scale(design: Design, samples: Sequence[AxisSamples], inertia: float) -> Design:
    """`design` with the column of the scale, less its nominal 1, where the data can tell it; else `design` as it is."""
    values = np.concatenate([rest_torque(entry.motion, inertia) for entry in samples])
    root = np.sqrt(design.weight)
    share = share_beside(design.matrix * root[:, None], values * root)
    seen = share * float(np.linalg.norm(values * root))
    if share < _LEAST_SHARE or seen < _LEAST_TORQUE * float(np.linalg.norm(design.target * root)):
        return design
    return design.extend(Term.MODEL_SCALE, values)


def rest_torque(motion: AxisMotion, inertia: float) -> Samples:
    """tau_rest (n,) [N·m or N]; `inertia` is the model's at qpos0 [kg·m² or kg]."""
    return np.asarray(motion.model_torque - inertia * motion.acceleration, dtype=np.float64)
