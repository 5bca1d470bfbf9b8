"""Faults that a drive detects: error code for 603Fh and EMCY, error register 1001h, and whether a ramp is possible.

Codes are those of the DS402 list (CiA 402-2 / IEC 61800-7-201, table 'Error codes'; bits of 1001h: CiA 301, 7.5.2.2), which
are those of DRIVECOM. The list has no code for a limit switch and none for safe torque off. It has 5440h 'contacts' with
5441h..5445h 'contact 1..5, manufacturer-specific', so what those three mean is the choice of this drive: 5441h the contact of
safe torque off, 5442h and 5443h that of the negative and of the positive limit switch. 8400h is the list's 'velocity speed
controller', here a speed beyond its limit.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.emulator.canopen.emergency import ErrorRegister


@dataclass(frozen=True)
class Fault:
    """`coasts`: the motor can give no torque that one may rely on, so 605Eh is not asked."""

    code: int
    register: int
    coasts: bool


_CURRENT = ErrorRegister.GENERIC | ErrorRegister.CURRENT
_VOLTAGE = ErrorRegister.GENERIC | ErrorRegister.VOLTAGE
_TEMPERATURE = ErrorRegister.GENERIC | ErrorRegister.TEMPERATURE
_COMMUNICATION = ErrorRegister.GENERIC | ErrorRegister.COMMUNICATION
_DRIVE = ErrorRegister.GENERIC | ErrorRegister.DEVICE_PROFILE

OVERCURRENT = Fault(0x2310, _CURRENT, coasts=True)
OVERLOAD = Fault(0x2350, _CURRENT, coasts=False)
OVERVOLTAGE = Fault(0x3210, _VOLTAGE, coasts=True)
UNDERVOLTAGE = Fault(0x3220, _VOLTAGE, coasts=True)
SAFE_TORQUE_OFF = Fault(0x5441, _DRIVE, coasts=True)
NEGATIVE_LIMIT_SWITCH = Fault(0x5442, _DRIVE, coasts=False)
POSITIVE_LIMIT_SWITCH = Fault(0x5443, _DRIVE, coasts=False)
ENCODER_LOSS = Fault(0x7305, _DRIVE, coasts=True)
OVERSPEED = Fault(0x8400, _DRIVE, coasts=False)
FOLLOWING_ERROR = Fault(0x8611, _DRIVE, coasts=False)

FAULTS = (
    OVERCURRENT,
    OVERLOAD,
    OVERVOLTAGE,
    UNDERVOLTAGE,
    SAFE_TORQUE_OFF,
    NEGATIVE_LIMIT_SWITCH,
    POSITIVE_LIMIT_SWITCH,
    ENCODER_LOSS,
    OVERSPEED,
    FOLLOWING_ERROR,
)

_GROUPS = {0x2: _CURRENT, 0x3: _VOLTAGE, 0x4: _TEMPERATURE}
_COMMUNICATION_GROUP = 0x81


def fault_of(code: int) -> Fault:
    """The fault of an error code; one that no drive finds by itself is told by its group and may ramp down."""
    known = {fault.code: fault for fault in FAULTS}
    communication = code >> 8 == _COMMUNICATION_GROUP
    return known.get(code, Fault(code, _COMMUNICATION if communication else _GROUPS.get(code >> 12, _DRIVE), coasts=False))
