"""Objects that a drive type must have, and objects that the virtual drive uses if the type has them.

An object that is mandatory (CiA 301, CiA 402-2) has to be there. One that is optional and missing is not on the bus, but the
behaviour still goes by its default (`DriveProfile.implicit`). tests/drive_profiles/test_requirements.py runs drives of either
kind: who makes the drive lean on one more object adds it here.
"""

from __future__ import annotations

from collections.abc import Iterable

Address = tuple[int, int]

_PDOS = range(4)

MANDATORY: frozenset[Address] = frozenset(
    {(index, 0) for index in (0x1000, 0x1001, 0x1018, 0x6040, 0x6041, 0x6060, 0x6061)} | {(0x1018, 1)}
)

_BY_MODE: dict[int, frozenset[Address]] = {
    1: frozenset({(0x607A, 0), (0x6081, 0)}),
    2: frozenset({(0x6042, 0)}),
    3: frozenset({(0x60FF, 0)}),
    4: frozenset({(0x6071, 0)}),
    6: frozenset({(0x6098, 0)}),
    7: frozenset({(0x60C1, 1)}),
    8: frozenset({(0x607A, 0)}),
    9: frozenset({(0x60FF, 0)}),
    10: frozenset({(0x6071, 0)}),
}
"""Without these there is no such mode, by its code (6060h)."""

_COMMUNICATION: frozenset[Address] = frozenset(
    {
        *((index, 0) for index in (0x1005, 0x1006, 0x1014, 0x1017)),
        *((0x1003, sub) for sub in (0, 1)),
        *((0x1018, sub) for sub in range(5)),
        *((base + pdo, sub) for base in (0x1400, 0x1800) for pdo in _PDOS for sub in (0, 1, 2)),
        *((0x1800 + pdo, sub) for pdo in _PDOS for sub in (3, 5)),
        *((base + pdo, sub) for base in (0x1600, 0x1A00) for pdo in _PDOS for sub in range(9)),
    }
)

_DRIVE: frozenset[Address] = frozenset(
    {
        *((index, 0) for index in (0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6072, 0x6076, 0x607F, 0x60B1, 0x60B2)),
        *((index, sub) for index in (0x608F, 0x6091, 0x6092) for sub in (0, 1, 2)),
    }
)

_OPTIONAL_BY_MODE: dict[int, frozenset[Address]] = {
    2: frozenset((index, sub) for index in (0x6046, 0x6048, 0x6049, 0x604C) for sub in (0, 1, 2)),
    6: frozenset({(0x607C, 0), (0x6099, 0), (0x6099, 1), (0x6099, 2), (0x609A, 0)}),
}


def mode_objects(mode: int) -> frozenset[Address]:
    """(index, sub-index) of every object without which there is no such mode of operation."""
    return _BY_MODE.get(mode, frozenset())


def required_objects(modes: Iterable[int]) -> frozenset[Address]:
    """(index, sub-index) of every object that the behaviour of a drive with these modes of operation goes by."""
    by_mode = (table.get(mode, frozenset()) for mode in modes for table in (_BY_MODE, _OPTIONAL_BY_MODE))
    return MANDATORY.union(_COMMUNICATION, _DRIVE, *by_mode)
