"""The torque that the drives' loops hold at standstill, which a feed-forward must not add a second time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.feedforward.alignment import Loops
from drivetwin.controller.feedforward.rest import LEAD_IN
from drivetwin.controller.motion import positions_now, stream
from drivetwin.controller.session import Session

HOLD = 2.4
"""Over how long the measured torque is averaged [s]; at 1 ms a current sensor's noise of 0.4 % of rated becomes 0.016 %."""

SETTLED = 0.1
"""Over how long the last of the stand tells where the axis stands beside its demand [s]; it creeps slower than that."""


def held_torque(session: Session, loops: Sequence[Loops]) -> NDArray[np.float64]:
    """Torque (axes,) [N·m or N] that the loops will give at the start of the next leg, without what is sent to them.

    Stands for `HOLD` and averages. An axis that stiction holds beside its demand lets its integrator run on, ever slower where
    it creeps: each sample counts as what it will have become by then.
    """
    standing = positions_now(session.drives)
    demand = np.repeat(standing[None, :], round(HOLD / session.cycle.period), axis=0)
    samples = stream(session.cycle, session.drives, demand)
    error = standing - samples.position
    held = []
    for axis, (drive, loop) in enumerate(zip(session.drives, loops, strict=True)):
        sent = drive.joint_torque(drive.rated_torque * drive.torque_offset / 1000.0)
        told = samples.torque[:, axis] + _still_to_come(error[:, axis], session.cycle.period, loop)
        held.append(told.mean() - sent)
    return np.array(held)


def _still_to_come(error: NDArray[np.float64], period: float, loop: Loops) -> NDArray[np.float64]:
    """By how much (n,) [N·m or N] each torque is below that `LEAD_IN` after the last: of Kv Kp (e + integral e dt / Ti)."""
    end = float(error[-round(SETTLED / period) :].mean())
    gain = loop.velocity_gain * loop.position_gain
    to_come = gain * (end - error)
    if loop.integral_time:
        to_come += gain / loop.integral_time * (period * (error.sum() - np.cumsum(error)) + LEAD_IN * end)
    return to_come
