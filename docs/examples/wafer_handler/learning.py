"""Learning from repetition: the remaining tracking difference becomes torque in the next run.

    u_next = Q[u + L e],   L e = J e'' + K (w + 1/Ti int w),   w = e' + Kp e

L is the inverse of the way from a torque to the position in the closed position and velocity loops, and Q a low-pass without
phase that leaves out what the model does not know (Bristow, Tharayil, Alleyne, A survey of iterative learning control,
IEEE Control Systems Magazine 26(3), 2006, plant inversion).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from drivetwin.controller.feedforward.alignment import Loops
from drivetwin.motion.filtering import zero_phase

Torque = NDArray[np.float64]


FADE = 0.03
"""Seconds about a move within which what was learned fades out."""


@dataclass(frozen=True)
class Learner:
    """Learns one axis's torque: its `loops`, `inertia` [kg·m² or kg], joint side, and up to which frequency it may learn."""

    loops: Loops
    inertia: float
    period: float
    cutoff_hz: float = 40.0

    def next(self, torque: Torque, error: NDArray[np.float64], moving: NDArray[np.bool_]) -> Torque:
        """What to add (n,) [N·m or N] in the next run, from what this one added and its tracking difference (n,) [m or rad].

        `moving` (n,) says where the demand moves. At standstill stiction holds whatever error there is, and a torque learned
        from it would one day break loose: there nothing is learned.
        """
        window = self._window(moving)
        learned = torque + window * self._ahead(self._cause(error, moving))
        return window * zero_phase(learned, self.period, self.cutoff_hz)

    def _cause(self, error: NDArray[np.float64], moving: NDArray[np.bool_]) -> Torque:
        """The torque (n,) that was missing when this difference came about in one move."""
        smooth = zero_phase(error - self._left_over(error, moving), self.period, self.cutoff_hz)
        speed = np.gradient(smooth, self.period)
        acceleration = np.gradient(speed, self.period)
        demanded = speed + self.loops.position_gain * smooth
        held = np.zeros_like(demanded)
        if self.loops.integral_time is not None:
            held = np.cumsum(np.where(moving, demanded, 0.0)) * self.period / self.loops.integral_time
        return np.asarray(self.inertia * acceleration + self.loops.velocity_gain * (demanded + held))

    def _left_over(self, error: NDArray[np.float64], moving: NDArray[np.bool_]) -> NDArray[np.float64]:
        """What is in the error (n,) because the axis stood beside its demand before: it says nothing of the torque in the move.

        It fades as the position loop works it off once the axis has broken away.
        """
        start = int(np.argmax(moving))
        since = np.maximum(np.arange(len(error)) - start, 0) * self.period
        return np.asarray(error[start] * np.exp(-self.loops.position_gain * since))

    def _ahead(self, torque: Torque) -> Torque:
        """Earlier by what lies between an offset and the motor's torque: half a cycle of holding, and the current loop."""
        rows = np.arange(len(torque), dtype=np.float64)
        return np.interp(rows + 0.5 + self.loops.current_lag / self.period, rows, torque)

    def _window(self, moving: NDArray[np.bool_]) -> NDArray[np.float64]:
        """1 where the demand moves, falling to 0 as a raised cosine over `FADE` (n,)."""
        width = max(1, round(FADE / self.period))
        away = distance_transform_edt(~moving)
        return np.asarray(0.5 * (1.0 + np.cos(np.pi * np.minimum(away / width, 1.0))))
