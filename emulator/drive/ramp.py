"""A value that changes at a given rate: the speed of velocity modes, of homing, of every stop; the torque of mode 4."""

from __future__ import annotations

from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.foundation.compiled import in_place


@in_place
def ramp_cycle(position: float, velocity: float, target: float, up: float, down: float, demand) -> None:  # type: ignore[no-untyped-def]
    """Fill demand (n, 4): speed moves towards `target` by `up` [rad/s²] while speeding up and `down` while slowing.

    Position [rad] is the integral from `position`; velocity in rad/s. The last row is where the next cycle goes on.
    """
    for period in range(demand.shape[0]):
        slowing = velocity * target < 0.0 or abs(target) < abs(velocity)
        change = (down if slowing else up) * SERVO_PERIOD
        before = velocity
        if slowing and velocity * target < 0.0 and abs(velocity) < change:
            velocity = 0.0
        elif abs(target - velocity) <= change:
            velocity = target
        else:
            velocity += change if target > velocity else -change
        position += 0.5 * (before + velocity) * SERVO_PERIOD
        demand[period, 0] = position
        demand[period, 1] = velocity


@in_place
def approach(value: float, target: float, rate: float, column) -> float:  # type: ignore[no-untyped-def]
    """Fill a column (n,) of demands with a value that goes to `target` by `rate` a second; the last one."""
    change = rate * SERVO_PERIOD
    for period in range(column.shape[0]):
        if abs(target - value) <= change * (1.0 + 1e-9):
            value = target
        else:
            value += change if target > value else -change
        column[period] = value
    return value
