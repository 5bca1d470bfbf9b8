"""Which CANopen service an identifier belongs to, by the predefined connection set (CiA 301, 7.3.3) and LSS (CiA 305)."""

from __future__ import annotations

SYNC = "SYNC"

SERVICES = (
    (range(0x000, 0x001), "NMT"),
    (range(0x080, 0x081), SYNC),
    (range(0x081, 0x100), "EMCY"),
    (range(0x100, 0x101), "TIME"),
    (range(0x181, 0x200), "TPDO 1"),
    (range(0x201, 0x280), "RPDO 1"),
    (range(0x281, 0x300), "TPDO 2"),
    (range(0x301, 0x380), "RPDO 2"),
    (range(0x381, 0x400), "TPDO 3"),
    (range(0x401, 0x480), "RPDO 3"),
    (range(0x481, 0x500), "TPDO 4"),
    (range(0x501, 0x580), "RPDO 4"),
    (range(0x581, 0x600), "SDO answer"),
    (range(0x601, 0x680), "SDO request"),
    (range(0x701, 0x780), "heartbeat"),
    (range(0x7E4, 0x7E6), "LSS"),
)
"""Identifiers of each service, with its name."""

OTHER = "other"

AT_LEISURE = frozenset({"NMT", "SDO answer", "SDO request", "LSS"})
"""Services of no cycle: their sender waits for the answer, or for nothing, and nobody counts on them within a cycle."""


def service(identifier: int) -> str:
    """The service's name; `other` for an identifier that a machine gave away by itself."""
    return next((name for identifiers, name in SERVICES if identifier in identifiers), OTHER)
