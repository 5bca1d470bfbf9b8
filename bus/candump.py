"""A frame as a line of `candump -L`, the format of every log that the product writes."""

from __future__ import annotations

from functools import lru_cache

MOST_BASE = 0x7FF
"""Greatest identifier of eleven bits."""


def candump_line(
    time: float, channel: str, identifier: int, data: bytes | bytearray, requested: int | None, extended: bool = False
) -> str:
    """The line, with its end: `time` [s], an interface's name, identifier and data in hexadecimal digits.

    A remote frame has the length that it asks for, `requested`, behind its R where that is not 0, as candump writes it and
    SocketCAN's tools, Wireshark and python-can read it (can-utils, lib.c, sprint_canframe); None: a data frame. python-can's
    own writer appends a direction to each line, which Wireshark's and tshark's readers do not take.
    """
    content = data.hex().upper() if requested is None else f"R{requested or ''}"
    return f"{_begin(time, channel)}{_digits(identifier, extended)}#{content}\n"


@lru_cache(maxsize=16)
def _begin(time: float, channel: str) -> str:
    """The same for all frames of one time, as those of a cycle in lockstep are."""
    return f"({time:.6f}) {channel} "


@lru_cache(maxsize=256)
def _digits(identifier: int, extended: bool) -> str:
    return f"{identifier:0{8 if extended or identifier > MOST_BASE else 3}X}"
