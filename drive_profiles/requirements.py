"""Which objects the virtual drive's behaviour cannot be without, whatever the drive type (CiA 301, CiA 402-2).

Everything else the drive takes where it is there. tests/drive_profiles/test_requirements.py runs a drive that has these
and no others: who makes the drive lean on one more object adds it here.
"""

from __future__ import annotations

from collections.abc import Iterable

Address = tuple[int, int]

_PDOS = range(4)

_COMMUNICATION: frozenset[Address] = frozenset(
    {
        *((index, 0) for index in (0x1000, 0x1001, 0x1005, 0x1006, 0x1014, 0x1017)),
        *((0x1003, sub) for sub in (0, 1)),
        *((0x1018, sub) for sub in range(5)),
        *((base + pdo, sub) for base in (0x1400, 0x1800) for pdo in _PDOS for sub in (0, 1, 2)),
        *((0x1800 + pdo, sub) for pdo in _PDOS for sub in (3, 5)),
        *((base + pdo, sub) for base in (0x1600, 0x1A00) for pdo in _PDOS for sub in range(9)),
    }
)

_DRIVE: frozenset[Address] = frozenset(
    {
        *((index, 0) for index in (0x6040, 0x6041, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6060, 0x6061, 0x6064, 0x606C)),
        *((index, 0) for index in (0x6072, 0x6076, 0x607E, 0x607F, 0x6083, 0x6084, 0x6085, 0x60B1, 0x60B2, 0x6502)),
        *((index, sub) for index in (0x608F, 0x6091, 0x6092) for sub in (0, 1, 2)),
    }
)

_BY_MODE: dict[int, frozenset[Address]] = {
    1: frozenset({(0x607A, 0), (0x6081, 0)}),
    2: frozenset({(0x6042, 0), *((index, sub) for index in (0x6046, 0x6048, 0x6049, 0x604C) for sub in (0, 1, 2))}),
    3: frozenset({(0x60FF, 0)}),
    4: frozenset({(0x6071, 0), (0x6087, 0)}),
    6: frozenset({(0x607C, 0), (0x6098, 0), (0x6099, 0), (0x6099, 1), (0x6099, 2), (0x609A, 0)}),
    7: frozenset({(0x60C1, 0), (0x60C1, 1)}),
    8: frozenset({(0x607A, 0)}),
    9: frozenset({(0x60FF, 0)}),
    10: frozenset({(0x6071, 0)}),
}
"""By code of the mode of operation (6060h)."""


def required_objects(modes: Iterable[int]) -> frozenset[Address]:
    """(index, sub-index) of every object that a drive with these modes of operation needs."""
    return _COMMUNICATION.union(_DRIVE, *(_BY_MODE.get(mode, frozenset()) for mode in modes))
