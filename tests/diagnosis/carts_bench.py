"""A cart on a cart: the motor of the lower one feels how the upper one moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

PERIOD, CUTOFF = 1e-3, 48.0
LOWER, UPPER, MOTOR, VISCOUS = 5.0, 2.0, 0.5, 4.0
"""Masses of the carts, and of the upper one's motor on its joint's side [kg]; damping of the upper one [N·s/m]."""
GEAR, STIFFNESS = 40.0, 9000.0
MODEL = f"""<mujoco model="carts"><option gravity="0 0 -10"/><worldbody>
<body><joint name="lower" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="{LOWER}" diaginertia="1 1 1"/>
<body><joint name="upper" type="slide" axis="1 0 0" armature="{MOTOR}" damping="{VISCOUS}"/>
<inertial pos="0 0 0" mass="{UPPER}" diaginertia="1 1 1"/></body></body></worldbody>
<actuator><motor name="lower" joint="lower"/><motor name="upper" joint="upper" gear="{GEAR}"/></actuator></mujoco>"""
TIME = np.arange(12000, dtype=np.float64) * PERIOD


def slope(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.gradient(values, PERIOD)


def waves(*of: tuple[float, float, float]) -> NDArray[np.float64]:
    """Sum of amplitude sin(2 pi frequency t + phase), (n,); from and to a rest of half a second, within two."""
    swings = np.sum([size * np.sin(2.0 * np.pi * rate * TIME + phase) for size, rate, phase in of], axis=0)
    share = np.clip((np.minimum(TIME, TIME[-1] - TIME) - 0.5) / 2.0, 0.0, 1.0)
    return np.asarray(swings * share**4 * (35.0 - 84.0 * share + 70.0 * share**2 - 20.0 * share**3))
