"""A measured motion of an axis that carries more than the model says: what it then needs, and how that varies."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.emulator.dynamics.axis import AxisDynamics
from drivetwin.emulator.dynamics.motion import Motion


def carried(motion: Motion, axis: AxisDynamics) -> Motion:
    """The motion, with loads, springs and inertia of the axis in what the rigid machine needs; shared, not to be written to.

    Weights and springs are those where the motor is, with their slopes; what else resists is that of the motor's motion.
    """
    if not (axis.load.acts or axis.joint.acts or axis.resisting):
        return motion
    return motion.changed_lately((axis.load, axis.joint, axis.resisting), lambda same: _carried(same, axis))


def _carried(motion: Motion, axis: AxisDynamics) -> Motion:
    joint, at = axis.joint, motion.position
    torque = (
        motion.rigid_torque + axis.load.resistance(at) + joint.inertia * motion.acceleration + joint.stiffness * at - joint.pull
    )
    for one in axis.resisting:
        torque = torque + one.resistance(at, motion.velocity, motion.time)
    return replace(
        motion,
        rigid_torque=torque,
        inertia=motion.inertia + joint.inertia,
        rotor_inertia=motion.rotor_inertia + joint.inertia,
        weight_slope=motion.weight_slope + axis.load.slope(at) + joint.stiffness,
    )
