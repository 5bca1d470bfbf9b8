"""Numbers on the bus in words: EMCY error codes, the error register, NMT states."""

from __future__ import annotations

_CODES = {
    0x0000: "error reset or no error",
    0x2310: "continuous over current, device output",
    0x2350: "load level fault (I²t, thermal state)",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x5441: "contact 1: safe torque off on the virtual drive",
    0x5442: "contact 2: negative limit switch on the virtual drive",
    0x5443: "contact 3: positive limit switch on the virtual drive",
    0x7305: "incremental sensor 1: encoder lost",
    0x8100: "communication, generic",
    0x8110: "CAN overrun, objects lost",
    0x8120: "CAN in error passive mode",
    0x8130: "life guard error or heartbeat error",
    0x8140: "recovered from bus off",
    0x8150: "CAN-ID collision",
    0x8210: "PDO not processed due to length error",
    0x8220: "PDO length exceeded",
    0x8240: "unexpected SYNC data length",
    0x8250: "RPDO time-out",
    0x8400: "velocity speed controller: over-speed on the virtual drive",
    0x8611: "following error",
}
"""CiA 301, table 26, and CiA 402-2, table 'Error codes'."""

_GROUPS = {
    0x10: "generic error",
    0x20: "current",
    0x21: "current, device input side",
    0x22: "current inside the device",
    0x23: "current, device output side",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the device",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "device temperature",
    0x50: "device hardware",
    0x60: "device software",
    0x61: "internal software",
    0x62: "user software",
    0x63: "data set",
    0x70: "additional modules",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol error",
    0x84: "velocity controller",
    0x86: "positioning controller",
    0x90: "external error",
    0xF0: "additional functions",
}

_REGISTER = ("generic", "current", "voltage", "temperature", "communication", "device profile", "reserved", "manufacturer")
"""Bits of 1001h (CiA 301, 7.5.2.2)."""

NMT_STATES = {0x00: "boot-up", 0x04: "stopped", 0x05: "operational", 0x7F: "pre-operational"}
"""As a heartbeat tells them (CiA 301, 7.2.8.3.2)."""

NMT_COMMANDS = {
    "Start": 0x01,
    "Stop": 0x02,
    "Enter pre-operational": 0x80,
    "Reset node": 0x81,
    "Reset communication": 0x82,
}
"""CiA 301, 7.2.8.3.1."""


def emergency_words(code: int) -> str:
    """An EMCY error code in words: itself, else its group."""
    if code in _CODES:
        return _CODES[code]
    group = _GROUPS.get(code >> 8) or _GROUPS.get(code >> 8 & 0xF0) or "device-specific"
    return f"{group} (code of the manufacturer or of another profile)"


def register_words(register: int) -> str:
    """The bits of 1001h that are set, in words."""
    return ", ".join(name for bit, name in enumerate(_REGISTER) if register >> bit & 1) or "none"
