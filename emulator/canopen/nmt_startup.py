"""Whether a node starts itself: NMT startup (CiA 302-2, 1F80h)."""

from __future__ import annotations

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary

NOT_BY_ITSELF, SELF_STARTING = 0x04, 0x08
"""Bit 2 keeps a node from entering operational by itself; bit 3 alone makes a slave do it."""

KNOWN = frozenset((0, NOT_BY_ITSELF, SELF_STARTING, NOT_BY_ITSELF | SELF_STARTING))
"""The other bits are an NMT master's."""


class NmtStartup:
    """1F80h of one node. A drive type without it waits for its master."""

    def __init__(self, od: ObjectDictionary) -> None:
        self._parameter = od.get(0x1F80)
        if self._parameter is not None:
            self._parameter.on_write = _check

    @property
    def self_starting(self) -> bool:
        """Whether the node goes on to operational after its boot-up message."""
        if self._parameter is None:
            return False
        return self._parameter.number & (NOT_BY_ITSELF | SELF_STARTING) == SELF_STARTING


def _check(value: Value) -> None:
    if value not in KNOWN:
        raise SdoAbort(AbortCode.INVALID_VALUE)
