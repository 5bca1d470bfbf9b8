"""A node's configuration, read from its dictionary, or from what was written to it on the bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from drivetwin.drive_profiles import DriveProfile
from drivetwin.emulator.drive.supervision import OFF
from drivetwin.hil_tests.evidence import Configuration

PDO_INVALID = 1 << 31
"""Bit 31 of 1400h:01 and 1800h:01 (CiA 301, 7.5.2.35)."""

Read = Callable[[int, int], float | None]
"""The value at an index and subindex; None where nobody knows it."""


def configuration(profile: DriveProfile, read: Read, time: float) -> Configuration:
    """The configuration of a node of that type at a time [s]."""
    objects = {(entry.index, entry.subindex) for entry in profile.objects}
    pdos, unknown = {}, []
    for name, communication in (("rpdo", 0x1400), ("tpdo", 0x1800)):
        for place in range(4):
            if (communication + place, 1) in objects:
                pdo = _pdo(read, communication + place)
                if pdo is None:
                    unknown.append(f"{name} {place + 1}")
                else:
                    pdos[f"{name} {place + 1}"] = pdo
    return Configuration(
        time=time,
        pdos=pdos,
        heartbeat=(read(0x1017, 0) or 0.0) * 1e-3,
        supervises=tuple(_supervision(profile, read)),
        limits_following_error=_limits_following_error(profile, read),
        unknown_pdos=tuple(unknown),
    )


def _pdo(read: Read, communication: int) -> tuple[int, int, tuple[int, ...]] | None:
    """COB-ID, transmission type, entries; None where they are not known. Of one that does not exist only the first matters."""
    cob_id, kind, count = read(communication, 1), read(communication, 2), read(communication + 0x200, 0)
    if cob_id is not None and int(cob_id) & PDO_INVALID:
        return int(cob_id), int(kind or 0), tuple(_entries(read, communication + 0x200, int(count or 0)))
    if cob_id is None or kind is None or count is None:
        return None
    entries = tuple(_entries(read, communication + 0x200, int(count)))
    return (int(cob_id), int(kind), entries) if len(entries) == int(count) else None


def _entries(read: Read, mapping: int, count: int) -> Iterator[int]:
    """Those that are known."""
    for place in range(count):
        entry = read(mapping, place + 1)
        if entry is not None:
            yield int(entry)


def _limits_following_error(profile: DriveProfile, read: Read) -> bool | None:
    """Whether the drive's own limit is set; None where its type has none."""
    role = profile.roles.get("following_error_limit")
    return None if role is None else 0 < (read(role.index, role.subindex) or 0.0) < OFF


def _supervision(profile: DriveProfile, read: Read) -> Iterator[str]:
    """By what the drive notices that its master has gone."""
    consumers = [entry.subindex for entry in profile.objects if entry.index == 0x1016 and entry.subindex]
    entries = [int(read(0x1016, subindex) or 0) for subindex in consumers]
    if any(entry & 0xFFFF and entry >> 16 & 0x7F for entry in entries):
        yield "heartbeat consumer (1016h)"
    if (read(0x100C, 0) or 0.0) * (read(0x100D, 0) or 0.0) > 0.0:
        yield "life guarding (100Ch, 100Dh)"
    role = profile.roles.get("bus_timeout")
    if role is not None and (read(role.index, role.subindex) or 0.0) > 0:
        yield "SYNC time-out of the drive type"
