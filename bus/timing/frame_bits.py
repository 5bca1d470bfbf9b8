"""The bits of a frame on a physical bus, with the stuff bits that its content asks for (ISO 11898-1; CAN 2.0 part A)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST_DATA = 8
"""Bytes that a classic frame can carry."""

LARGEST_IDENTIFIER = 0x7FF

CRC_LENGTH = 15
CRC_POLYNOMIAL = 0x4599
"""x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, its highest term left out."""

UNSTUFFED_TAIL = 1 + 2 + 7
"""CRC delimiter, ACK slot and delimiter, end of frame: of fixed form, never stuffed [bit]."""

INTERMISSION = 3
"""Recessive bits between a frame and the next start of frame [bit]."""


class Rtr(IntEnum):
    """The remote transmission request bit: a data frame's is dominant."""

    DATA = 0
    REMOTE = 1


@dataclass(frozen=True)
class Frame:
    """A classic frame with an 11-bit identifier. A remote frame carries no data, but the length of what it asks for."""

    identifier: int
    data: bytes = b""
    requested: int | None = None
    """Data length code of a remote frame [byte]; None: a data frame."""

    def __post_init__(self) -> None:
        """Raise ValueError for what fits into no such frame."""
        if not 0 <= self.identifier <= LARGEST_IDENTIFIER:
            raise ValueError(f"identifier {self.identifier:X}h; a base frame has 000h to 7FFh")
        if len(self.data) > MOST_DATA or not 0 <= (self.requested or 0) <= MOST_DATA:
            raise ValueError(f"{self.identifier:03X}h has more than 8 bytes; a classic frame has 0 to 8")
        if self.requested is not None and self.data:
            raise ValueError(f"{self.identifier:03X}h is a remote frame with data; a remote frame has none")

    @property
    def rtr(self) -> Rtr:
        """What arbitration sees after the identifier."""
        return Rtr.DATA if self.requested is None else Rtr.REMOTE

    @property
    def length_code(self) -> int:
        """Data length code [byte]."""
        return len(self.data) if self.requested is None else self.requested


def frame_bits(frame: Frame) -> int:
    """Bits from the start of frame to the earliest next one: stuff bits and the 3 bits of intermission are counted.

    47 + 8 s bits for s bytes of data, and at most floor((33 + 8 s) / 4) stuff bits, so 55 + 10 s at most (Davis, Burns, Bril,
    Lukkien 2007, 'Controller Area Network (CAN) schedulability analysis: refuted, revisited and revised', equations 1 and 2).
    """
    fields = [(_head(frame), 19), *((byte, 8) for byte in frame.data), *_halves(crc(frame))]
    run, stuffed = _IDLE, 0
    for bits, length in fields:
        run, more = _stuff(run, bits, length)
        stuffed += more
    return sum(length for _, length in fields) + stuffed + UNSTUFFED_TAIL + INTERMISSION


def all_frame_bits(
    identifiers: NDArray[np.uint32], lengths: NDArray[np.uint8], data: NDArray[np.uint8], remote: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """`frame_bits` of n frames at once (n,): identifiers, length codes and `remote` (n,), data (n, 8)."""
    sizes = np.where(remote, 0, lengths).astype(np.int64)
    heads = identifiers.astype(np.int64) << 7 | remote.astype(np.int64) << 6 | lengths
    crcs = np.zeros(len(heads), np.int64)
    for byte in (heads >> 16, heads >> 8 & 0xFF, heads & 0xFF):
        crcs = _next_crc(crcs, byte)
    wire = _Wire(len(heads))
    for bits, length in ((heads >> 11, 8), (heads >> 3 & 0xFF, 8), (heads & 7, 3)):
        wire.send(bits, length)
    for place in range(int(sizes.max(initial=0))):
        there = np.flatnonzero(sizes > place)
        byte = data[there, place].astype(np.int64)
        crcs[there] = _next_crc(crcs[there], byte)
        wire.send(byte, 8, there)
    wire.send(crcs >> 7, 8)
    wire.send(crcs & 0x7F, 7)
    return 19 + 8 * sizes + CRC_LENGTH + wire.stuffed + UNSTUFFED_TAIL + INTERMISSION


def _next_crc(register: NDArray[np.int64], byte: NDArray[np.int64]) -> NDArray[np.int64]:
    brought = _remainders()[register >> CRC_LENGTH - 8 ^ byte]
    return np.asarray((register << 8 & (1 << CRC_LENGTH) - 1) ^ brought)


class _Wire:
    """What n frames leave on the wire while they are sent, each on its own: the run that they end with, and stuff bits."""

    def __init__(self, frames: int) -> None:
        self._run = np.full(frames, _place(_IDLE))
        self.stuffed = np.zeros(frames, np.int64)

    def send(self, bits: NDArray[np.int64], length: int, there: NDArray[np.intp] | slice = slice(None)) -> None:
        """`length` bits more of the frames `there`."""
        runs, stuffed = _stuff_table(length)
        before = self._run[there]
        self.stuffed[there] += stuffed[before, bits]
        self._run[there] = runs[before, bits]


def crc(frame: Frame) -> int:
    """The CRC sequence: the remainder over start of frame, identifier, control field and data (ISO 11898-1)."""
    register = 0
    for byte in (*_head(frame).to_bytes(3, "big"), *frame.data):  # zeros before the start of frame leave the remainder alone
        register = (register << 8 & (1 << CRC_LENGTH) - 1) ^ _remainder(register >> CRC_LENGTH - 8 ^ byte)
    return register


def _head(frame: Frame) -> int:
    """Start of frame (dominant: 0), identifier, RTR, IDE and r0 (dominant), data length code: 19 bits."""
    return frame.identifier << 7 | frame.rtr << 6 | frame.length_code


def _halves(sequence: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """A CRC sequence in two: (bits, length) of each."""
    return (sequence >> 7, 8), (sequence & 0x7F, 7)


@cache
def _remainders() -> NDArray[np.int64]:
    return np.array([_remainder(byte) for byte in range(256)])


@cache
def _remainder(byte: int) -> int:
    """What eight bits that leave the register bring back into it."""
    register = byte << CRC_LENGTH - 8
    for _ in range(8):
        register <<= 1
        if register >> CRC_LENGTH:
            register ^= 1 << CRC_LENGTH | CRC_POLYNOMIAL
    return register


class _Run(NamedTuple):
    """The equal bits that the wire ends with: which, and how many."""

    level: int
    equal: int


_IDLE = _Run(level=1, equal=0)
"""The recessive bits of an idle bus are in no run: stuffing begins with the start of frame."""


@cache
def _stuff(run: _Run, bits: int, length: int) -> tuple[_Run, int]:
    """Send `length` bits, the highest first, after `run`: the run that they leave, and how many stuff bits went between.

    After five equal bits an opposite one follows; it counts for the next five (ISO 11898-1, bit stuffing).
    """
    level, equal, stuffed = run.level, run.equal, 0
    for place in reversed(range(length)):
        bit = bits >> place & 1
        level, equal = (bit, equal + 1) if bit == level else (bit, 1)
        if equal == 5:
            level, equal, stuffed = 1 - level, 1, stuffed + 1
    return _Run(level, equal), stuffed


_LONGEST_RUN = 5


def _place(run: _Run) -> int:
    """Of a run in a table."""
    return run.level * _LONGEST_RUN + run.equal


@cache
def _stuff_table(length: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """`_stuff` of every run (10) and all bits (2 ** length): the place of the next run, and stuff bits."""
    runs = [_Run(level, equal) for level in (0, 1) for equal in range(_LONGEST_RUN)]
    sent = [[_stuff(run, bits, length) for bits in range(1 << length)] for run in runs]
    return np.array([[_place(run) for run, _ in row] for row in sent]), np.array([[more for _, more in row] for row in sent])
