"""One column from the drive's unit to SI on the joint side."""

from __future__ import annotations

import math
from collections.abc import Callable

from drivetwin.foundation.errors import UserError
from drivetwin.recording.import_map import AxisMap, ColumnMap
from drivetwin.recording.recording import Samples
from drivetwin.recording.units import Kind, unit_for


def to_joint_side(where: str, name: str, raw: Samples, column: ColumnMap, axis: AxisMap) -> Samples:
    """`sign * (scale * raw + offset)` in the column's unit as rad, m, rad/s, m/s, N·m, N or degC on the joint side.

    A motor-side angle is divided by the gear ratio (rad/m on a slide), a motor-side torque is multiplied by it. `where`
    begins every message. Raises UserError for a unit that does not fit the joint, and for a constant the map lacks.
    """
    try:
        unit = unit_for(name, column.unit or "")
        factor = unit.factor * _FACTORS[unit.kind](column, axis)
    except UserError as error:
        raise UserError(f"{where}: {error}") from error
    return factor * (column.sign * (column.scale * raw + column.offset)) + unit.zero


def _turning(column: ColumnMap, axis: AxisMap) -> float:
    return _motor_angle(axis) if column.side == "motor" else _needs_joint("hinge", column, axis)


def _turning_torque(column: ColumnMap, axis: AxisMap) -> float:
    return _gear(axis) if column.side == "motor" else _needs_joint("hinge", column, axis)


def _straight(column: ColumnMap, axis: AxisMap) -> float:
    if column.side == "motor":
        raise UserError(
            f"unit {column.unit} is of a straight motion, which no motor shaft has; leave out `side: motor`"
        )
    return _needs_joint("slide", column, axis)


def _user(column: ColumnMap, axis: AxisMap) -> float:
    units = _needed(axis.user_units_per_motor_turn, "user_units_per_motor_turn (6092h through the gear)", column)
    return 2 * math.pi / units * _motor_angle(axis)


def _share_of_rated(column: ColumnMap, axis: AxisMap) -> float:
    return _needed(axis.joint_rated_torque(), "rated_torque (joint side) or motor_rated_torque", column)


def _as_it_is(_column: ColumnMap, _axis: AxisMap) -> float:
    return 1.0


def _motor_angle(axis: AxisMap) -> float:
    return 1.0 / _gear(axis)


def _gear(axis: AxisMap) -> float:
    if axis.gear_ratio is None:
        raise UserError(
            "the map lacks gear_ratio (motor turns a joint turn, rad/m on a slide), which `side: motor` needs"
        )
    return axis.gear_ratio


def _needs_joint(wanted: str, column: ColumnMap, axis: AxisMap) -> float:
    if axis.joint_type != wanted:
        remedy = "`side: motor` with gear_ratio" if wanted == "hinge" else "`joint_type: slide`"
        raise UserError(f"unit {column.unit} does not fit a joint of type {axis.joint_type}; give {remedy} in the map")
    return 1.0


def _increment(column: ColumnMap, axis: AxisMap) -> float:
    """Joint-side size of an increment: by the motor's encoder where it is known, else by the joint's own resolution."""
    if axis.encoder_increments is not None:
        return 2 * math.pi / axis.encoder_increments * _motor_angle(axis)
    return _needed(
        axis.position_resolution, "encoder_increments (a motor turn) or position_resolution (joint side)", column
    )


def _electric(column: ColumnMap, axis: AxisMap) -> float:
    """Joint-side torque or force of an ampere or a volt."""
    if axis.force_constant is not None:
        return axis.force_constant
    constant = _needed(
        axis.torque_constant, "torque_constant (motor side) or force_constant (joint side), a unit", column
    )
    return constant * _gear(axis)


def _needed(value: float | None, name: str, column: ColumnMap) -> float:
    if value is None:
        raise UserError(f"unit {column.unit} needs {name} of the axis, which the map lacks")
    return value


_FACTORS: dict[Kind, Callable[[ColumnMap, AxisMap], float]] = {
    Kind.ANGLE: _turning,
    Kind.ANGULAR_SPEED: _turning,
    Kind.LENGTH: _straight,
    Kind.SPEED: _straight,
    Kind.INCREMENTS: _increment,
    Kind.INCREMENT_RATE: _increment,
    Kind.USER: _user,
    Kind.USER_RATE: _user,
    Kind.TORQUE: _turning_torque,
    Kind.FORCE: _straight,
    Kind.CURRENT: _electric,
    Kind.VOLTAGE: _electric,
    Kind.RATIO: _share_of_rated,
    Kind.TEMPERATURE: _as_it_is,
}
