"""From power-on to operational: NMT, identity, scaling, parameters, PDO mapping, all read back."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.error_control import set_error_control
from drivetwin.controller.limits import Limits, apply_torque_limits
from drivetwin.controller.link import SDO_TIMEOUT, SDO_TIMEOUT_IN_CYCLES, Link
from drivetwin.controller.machine import Machine
from drivetwin.drive_profiles import DriveProfile
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

BOOT_TIMEOUT = 10.0
"""Longest wait for the boot-up messages after a reset of communication [s]."""

QUICK_BEAT = 5
"""Heartbeat time for a check [ms]."""

LISTEN = 0.2
"""How long a drive whose time moves may take to be heard [s]; a loaded host stalls a process for some 10 ms."""

SDO_REQUEST, SDO_ANSWER = 0x600, 0x580
"""COB-IDs of the default SDO, less the node-ID."""

UPLOAD_OF_THE_SERIAL_NUMBER = bytes((0x40, 0x18, 0x10, 4, 0, 0, 0, 0))
"""Of 1018h:04. Two devices that said the same at the same time would be one frame on the wire; their serial numbers differ."""

SECOND_ANSWER = 0.05
"""How long a second answer to one request may take after the first [s]."""

SLOW_DOWN_ON_QUICK_STOP_RAMP = 2
"""605Ah and 605Eh: ramp of 6085h, then switch on disabled, or fault."""


def connect(link: Link, machine: Machine, profile: DriveProfile) -> list[DriveNode]:
    """The machine's drives on this link, not yet spoken to.

    Raises UserError for a drive type that this controller cannot stream to or capture from.
    """
    if lacking := [role for role in ("position_setpoint", "torque_actual") if role not in profile.roles]:
        raise UserError(
            f"drives of type {profile.name} have no {' and no '.join(lacking)} for a PDO to carry, and this procedure needs "
            "them; choose another --profile"
        )
    return [DriveNode(link, name, axis, profile) for name, axis in machine.axes.items()]


def bring_up(link: Link, drives: Sequence[DriveNode], cycle_time: float, limits: Limits | None = None) -> None:
    """Reset communication, check who is there, configure every drive, with no more torque than `limits`, and start it.

    Raises UserError naming the axis and the object for a missing node, one that is there twice, another device, a refused or
    silently changed value.
    """
    link.drain()  # a boot-up message from before the reset is no answer to it
    for drive in drives:  # each by itself: the bus may carry nodes that are none of ours
        drive.liveness.begin()
        drive.liveness.expected = False
        drive.reset_communication()
    _await_boots(link, drives)
    for drive in drives:
        _check_one_answers(link, drive)
    _check_each_booted_once(drives)
    for drive in drives:
        _check_device(drive)
        _configure(drive, cycle_time)
    if limits is not None:
        apply_torque_limits(drives, limits)
    _check_each_booted_once(drives)
    for drive in drives:
        drive.start_operation()
    for drive in drives:
        drive.statusword = int(drive.read(0x6041))
    link.drain()
    for drive in drives:
        drive.liveness.begin()
        drive.liveness.expected = True


def check_time_stands_still(link: Link, drive: DriveNode) -> None:
    """Raise UserError where a drive's time moves without SYNC: set-points sent as fast as they go would then outrun it.

    The drive is asked for a heartbeat; one that comes although no SYNC was sent tells.
    """
    former = int(drive.read(0x1017))
    heard = drive.liveness.beats
    drive.write(QUICK_BEAT, 0x1017)
    beating = link.wait_until(lambda: drive.liveness.beats > heard, LISTEN)
    drive.write(former, 0x1017)
    if beating:
        raise UserError(
            f"{drive.where()} keeps time by itself, and --clock sync sends as fast as it goes: give --clock realtime "
            "(or start the emulator with --clock sync)"
        )


def _await_boots(link: Link, drives: Sequence[DriveNode]) -> None:
    if link.wait_until(lambda: all(drive.liveness.boots for drive in drives), BOOT_TIMEOUT):
        return
    missing = next(drive for drive in drives if not drive.liveness.boots)
    present = ", ".join(str(drive.node_id) for drive in drives if drive.liveness.boots) or "none"
    raise UserError(
        f"{missing.where()} sent no boot-up message on {link.wire.channel_info} within {BOOT_TIMEOUT:g} s "
        f"(nodes that did: {present}): is the drive powered, and is {missing.node_id} its node-ID?"
    )


def _check_one_answers(link: Link, drive: DriveNode) -> None:
    """Raise UserError where one request has two answers. The first is awaited: late, it would pass for the next request's."""
    answers: list[bytes] = []
    cob_id = SDO_ANSWER + drive.node_id
    link.fast[cob_id] = answers.append
    link.send(SDO_REQUEST + drive.node_id, UPLOAD_OF_THE_SERIAL_NUMBER)
    if link.wait_until(lambda: bool(answers), SDO_TIMEOUT if link.cycle is None else SDO_TIMEOUT_IN_CYCLES):
        link.wait_until(lambda: len(answers) > 1, SECOND_ANSWER)
    link.fast.pop(cob_id)
    if len(answers) > 1:
        raise _there_twice(drive, f"one SDO request had {len(answers)} answers")


def _check_each_booted_once(drives: Sequence[DriveNode]) -> None:
    """Raise UserError where one reset has brought two boot-up messages."""
    for drive in drives:
        if drive.liveness.boots > 1:
            raise _there_twice(drive, f"one reset brought {drive.liveness.boots} boot-up messages")


def _there_twice(drive: DriveNode, what: str) -> UserError:
    return UserError(
        f"{drive.where()}: {what}; is a second device set to node-ID {drive.node_id}, or does one restart by itself? "
        "Each device on the bus needs a node-ID of its own"
    )


def _check_device(drive: DriveNode) -> None:
    device_type = int(drive.read(0x1000))
    if device_type & 0xFFFF != 402:
        raise UserError(
            f"{drive.where()} is not a servo drive: device type 1000h is {device_type:08X}h, expected ....0192h (CiA 402)"
        )
    modes = int(drive.read(0x6502))
    if not modes & 1 << drive.profile.streaming_mode - 1:
        raise UserError(
            f"{drive.where()} does not support mode {drive.profile.streaming_mode} (6502h is {modes:08X}h); "
            "choose the --profile that this drive is"
        )
    vendor, product = int(drive.read(0x1018, 1)), int(drive.read(0x1018, 2))
    if (vendor, product) != (drive.profile.vendor_id, drive.profile.product_code):
        logger.warning(
            "%s is vendor %Xh product %Xh, profile %s expects %Xh %Xh",
            drive.where(),
            vendor,
            product,
            drive.profile.name,
            drive.profile.vendor_id,
            drive.profile.product_code,
        )


def _configure(drive: DriveNode, cycle_time: float) -> None:
    drive.write_scaling()
    drive.write(round(cycle_time * 1e6), 0x1006)
    drive.write(round(cycle_time * 1e3), 0x60C2, 1)
    drive.write(-3, 0x60C2, 2)
    spline = drive.profile.interpolation_codes.get("cubic_spline")
    if spline is not None:
        drive.write_role("interpolation_type", spline)
    drive.write(drive.ramp(2.0 * drive.axis.max_acceleration), 0x6085)
    for index in (0x605A, 0x605E):
        drive.write(SLOW_DOWN_ON_QUICK_STOP_RAMP, index)
    for index in (0x6083, 0x6084):
        drive.write(drive.ramp(drive.axis.max_acceleration), index)
    drive.write(drive.in_units(drive.axis.max_speed * 1.2), 0x607F)
    drive.limit_following_error(drive.axis.max_speed * FOLLOWING_ERROR_TIME)
    set_error_control(drive)
    drive.map_pdos()


FOLLOWING_ERROR_TIME = 0.05
"""Following error that an axis may have, as time at its full speed [s]."""
