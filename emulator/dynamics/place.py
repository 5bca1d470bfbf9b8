"""The indices of an axis in MuJoCo's arrays, for compiled code."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Place:
    """Addresses of an axis: its joint, its motor's (the same where the transmission is rigid), its actuator.

    `gear`: motor turns a joint turn, or rad/m; `brake`: the holding brake's torque at the joint [N·m or N];
    `motor_inertia`: the rotor's on the joint side [kg·m² or kg].
    """

    axis: int
    gear: float
    brake: float
    motor_inertia: float
    qpos: int
    dof: int
    motor_qpos: int
    motor_dof: int
    actuator: int
