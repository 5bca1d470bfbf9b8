"""What the drives' loops hold while the axes stand: the torque that a feed-forward must not tell them again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from controller.feedforward.alignment import Loops
from controller.feedforward.leg import LEAD_IN
from controller.motion import positions_now, stream
from controller.session import Session

HOLD = 2.4
"""Over how long the measured torque is averaged [s]; at 1 ms a current sensor's noise of 0.4 % of rated becomes 0.016 %."""


def held_torque(session: Session, loops: Sequence[Loops]) -> NDArray[np.float64]:
    """Torque (axes,) [N·m or N] that the loops will give at the start of the next leg, without what is sent to them.

    Stands for `HOLD` and averages. An axis that stiction holds beside its demand lets its integrator run on at a known rate:
    velocity_gain position_gain error / integral_time.
    """
    standing = positions_now(session.drives)
    demand = np.repeat(standing[None, :], round(HOLD / session.cycle.period), axis=0)
    samples = stream(session.cycle, session.drives, demand)
    error = (standing - samples.position.mean(axis=0)).tolist()
    told = samples.torque.mean(axis=0).tolist()
    held = []
    for drive, loop, torque, beside in zip(session.drives, loops, told, error, strict=True):
        sent = drive.joint_torque(drive.rated_torque * drive.torque_offset / 1000.0)
        rate = loop.velocity_gain * loop.position_gain * beside / loop.integral_time if loop.integral_time else 0.0
        held.append(torque - sent + rate * (0.5 * HOLD + LEAD_IN))
    return np.array(held)
