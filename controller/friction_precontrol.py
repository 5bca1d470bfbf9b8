"""Writes an identified friction law into a drive's friction table, so that the drive compensates it before an error builds up.

On a ServoOne 2182h in per cent of the motor's rated torque at 2183h in rpm, CON_SCON_TFric and CON_SCON_TFricSpeed. P388
(2184h), a constant torque, stays as it is: a load is no friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.controller.drive_node import DriveNode, place
from drivetwin.controller.friction_table import POINTS, FrictionTable, Point, friction_table
from drivetwin.controller.stop import WITHOUT_VOLTAGE
from drivetwin.drive_profiles import DriveProfile, Role
from drivetwin.foundation.errors import InterruptedByUserError, UserError
from drivetwin.identification.friction_law import FrictionLaw


@dataclass(frozen=True)
class Change:
    """What a drive's table is, what is to become of it, and the rated torque [N·m] that its per cents refer to."""

    before: tuple[Point, ...]
    table: FrictionTable
    rated_torque: float


@dataclass(frozen=True)
class Planned:
    """A change and the drive that it is planned for."""

    drive: DriveNode
    change: Change


def check_drive_type(profile: DriveProfile) -> None:
    """Raise UserError for a drive type that has no friction table."""
    if "friction_torque" not in profile.roles or "friction_speed" not in profile.roles:
        raise UserError(f"drives of type {profile.name} have no friction table to write to; a servoone has one (2182h, 2183h)")


def plan(drive: DriveNode, law: FrictionLaw) -> Change:
    """What writing a law to a drive would change; nothing is written.

    Raises UserError where the drive has no friction table, is another device, has voltage on, or cannot hold the values.
    """
    check_drive_type(drive.profile)
    _check_vendor(drive)
    _check_without_voltage(drive)
    change = Change(read_points(drive), friction_table(law, drive.axis), drive.rated_torque)
    _check_torque(drive, change)
    for value, index, subindex in _raw(drive, change.table.points):
        _check_range(drive, value, index, subindex)
    return change


def read_points(drive: DriveNode) -> tuple[Point, ...]:
    """The five points that a drive has now."""
    torque, speed = _roles(drive)
    return tuple(
        Point(
            float(drive.read(speed.index, speed.subindex + entry)) * speed.si_per_unit,
            float(drive.read(torque.index, torque.subindex + entry)) * torque.si_per_unit * drive.rated_torque,
        )
        for entry in range(POINTS)
    )


def write_friction(planned: Sequence[Planned]) -> None:
    """Write planned tables, each value read back: all of them, or none.

    Whatever ends it early, the former values are put back, and what it raises says of which drives. Raises UserError where
    voltage has come on since, or a drive refuses a value; for Ctrl-C InterruptedByUserError.
    """
    for one in planned:
        _check_without_voltage(one.drive)
    touched: list[Planned] = []
    try:
        for one in planned:
            touched.append(one)
            for value, index, subindex in _raw(one.drive, one.change.table.points):
                one.drive.write(value, index, subindex)
    except KeyboardInterrupt:
        raise InterruptedByUserError(f"interrupted; {_put_back(touched)}") from None
    except UserError as error:
        raise type(error)(f"{error}; {_put_back(touched)}") from None
    except BaseException as error:
        error.add_note(_put_back(touched))
        raise


def _put_back(touched: Sequence[Planned]) -> str:
    """Write the former values, each drive whatever befalls the others; what became of the tables."""
    back, doubtful = [], []
    for one in touched:
        try:
            _restore(one.drive, one.change.before)
            back.append(one.drive.where())
        except (UserError, KeyboardInterrupt) as error:
            doubtful.append(f"{one.drive.where()} ({error or 'interrupted'})")
    told = [f"the former friction table of {', '.join(back)} is back"] if back else []
    if doubtful:
        told.append(f"NOT KNOWN TO BE BACK: {', '.join(doubtful)}: write it again before the axis moves")
    return "; ".join(told)


def _restore(drive: DriveNode, former: Sequence[Point]) -> None:
    """Write what differs from the former table: what the drive refused has not changed, and would be refused again."""
    _check_without_voltage(drive)
    now = _raw(drive, read_points(drive))
    for value, index, subindex in _raw(drive, former):
        if (value, index, subindex) not in now:
            drive.write(value, index, subindex)


def _roles(drive: DriveNode) -> tuple[Role, Role]:
    return drive.profile.roles["friction_torque"], drive.profile.roles["friction_speed"]


def _raw(drive: DriveNode, points: Sequence[Point]) -> list[tuple[float, int, int]]:
    """Raw value, index and sub-index of each entry of a table."""
    torque, speed = _roles(drive)
    return [
        entry
        for number, point in enumerate(points)
        for entry in (
            (point.torque / drive.rated_torque / torque.si_per_unit, torque.index, torque.subindex + number),
            (point.speed / speed.si_per_unit, speed.index, speed.subindex + number),
        )
    ]


def _check_vendor(drive: DriveNode) -> None:
    vendor = int(drive.read(0x1018, 1))
    if vendor != drive.profile.vendor_id:
        raise UserError(
            f"{drive.where()} is a device of vendor {vendor:X}h, and a {drive.profile.name} is of vendor "
            f"{drive.profile.vendor_id:X}h: its manufacturer's objects mean something else; choose the --profile that it is"
        )


def _check_without_voltage(drive: DriveNode) -> None:
    drive.statusword = int(drive.read(0x6041))
    if drive.state not in WITHOUT_VOLTAGE:
        raise UserError(
            f"{drive.where()} may have voltage on (statusword 6041h is {drive.statusword:04X}h, expected switch on disabled or "
            "fault): a friction table that changes there is a step of torque; take the voltage off first"
        )


def _check_torque(drive: DriveNode, change: Change) -> None:
    """Raise UserError where friction alone is more than the drive gives (6072h)."""
    most = float(drive.read(0x6072)) / 1000.0 * change.rated_torque
    wanted = max(point.torque for point in change.table.points)
    if wanted > most:
        raise UserError(
            f"friction of {drive.where()} takes {wanted:.4g} N·m of the motor, and the drive gives {most:.4g} N·m (6072h): is "
            "the file of this machine, and is its gear what the controller takes it for?"
        )


def _check_range(drive: DriveNode, value: float, index: int, subindex: int) -> None:
    """Raise UserError for a value that the object cannot hold, as far as the drive type says."""
    entry = next(one for one in drive.profile.objects if (one.index, one.subindex) == (index, subindex))
    low, high = -np.inf if entry.low is None else entry.low, np.inf if entry.high is None else entry.high
    if not low <= value <= high:
        raise UserError(f"{drive.where()}: {value:.4g} is outside the range of {place(index, subindex)}, {low:g} to {high:g}")
