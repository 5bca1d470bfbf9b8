"""The frames of a bus log around an instant, decoded: service, node and content."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from drivetwin.bus.timing.services import service
from drivetwin.emulator.canopen.abort_codes import AbortCode
from drivetwin.emulator.canopen.nmt import NmtCommand, NmtState
from drivetwin.hil_tests.results.pdo_words import PdoMapping, pdo_words

BEFORE, AFTER = 16, 10
"""How many frames next to the instant are shown."""

TELLING = frozenset({"NMT", "EMCY", "SDO request", "SDO answer"})
"""Services that say what somebody wanted, or what is wrong: shown from further around."""

MOST_TELLING = 16
AROUND = 0.25
"""[s]"""

_LINE = re.compile(r"\((\d+\.\d+)\) \S+ ([0-9A-F]+)#(?:(R)\d?|([0-9A-F]*))$")
_NODE = 0x7F
_NOT_OF_A_NODE = frozenset({"NMT", "SYNC", "TIME", "LSS"})
_SDO_ABORT = 0x80
_TOGGLE_GUARDING = 0x80


@dataclass(frozen=True)
class ShownFrame:
    """A frame for a reader: simulated time [s], identifier, node (None: not of one), service, data, and what it says."""

    time: float
    identifier: int
    node: int | None
    service: str
    data: bytes
    words: str


def excerpt(log: Path, time: float | None, pdos: PdoMapping) -> tuple[ShownFrame, ...]:
    """The frames next to `time` [s] and what is telling around it, in their order; the last of the log where it is None."""
    frames = list(_frames(log))
    times = [frame.time for frame in frames]
    at = len(frames) if time is None else bisect_right(times, time)
    next_to = set(range(max(0, at - BEFORE), min(len(frames), at + AFTER)))
    centre = times[-1] if time is None and times else time or 0.0
    around = range(bisect_left(times, centre - AROUND), bisect_right(times, centre + AROUND))
    telling = [place for place in around if service(frames[place].identifier) in TELLING]
    nearest = sorted(telling, key=lambda place: abs(place - at))[:MOST_TELLING]
    return tuple(_shown(frames[place], pdos) for place in sorted(next_to.union(nearest)))


class _Frame(NamedTuple):
    """A line of the log; `data` as its hexadecimal text."""

    time: float
    identifier: int
    remote: bool
    data: str


def _frames(log: Path) -> Iterator[_Frame]:
    with log.open(encoding="ascii") as stream:
        for line in stream:
            found = _LINE.match(line)
            if found is not None:
                yield _Frame(float(found[1]), int(found[2], 16), bool(found[3]), found[4] or "")


def _shown(frame: _Frame, pdos: PdoMapping) -> ShownFrame:
    name, data = service(frame.identifier), bytes.fromhex(frame.data)
    node = None if name in _NOT_OF_A_NODE or frame.identifier > 0x7FF else frame.identifier & _NODE
    said = "requested" if frame.remote else pdo_words(pdos[name], data) if name in pdos else words(name, data)
    return ShownFrame(frame.time, frame.identifier, node, name, data, said)


def words(name: str, data: bytes) -> str:
    """What a frame of a service says (CiA 301, 7.2.4, 7.2.7, 7.2.8); empty for what is not told by its service."""
    if name == "NMT" and len(data) == 2:
        return f"{_named(NmtCommand, data[0])}, {f'node {data[1]}' if data[1] else 'all nodes'}"
    if name == "EMCY" and len(data) == 8:
        code = int.from_bytes(data[:2], "little")
        return f"error {code:04X}h" if code else "error reset"
    if name == "heartbeat" and len(data) == 1:
        return _named(NmtState, data[0] & ~_TOGGLE_GUARDING) if data[0] else "boot-up"
    if name in ("SDO request", "SDO answer") and len(data) == 8:
        return _sdo(data, name == "SDO request")
    return ""


def _sdo(data: bytes, request: bool) -> str:
    """The first byte's upper three bits are the command (CiA 301, 7.2.4.3)."""
    there, command = f"{int.from_bytes(data[1:3], 'little'):04X}h:{data[3]:02X}", data[0] >> 5
    if data[0] == _SDO_ABORT:
        code = int.from_bytes(data[4:], "little")
        text = next((f"{known.text}, " for known in AbortCode if known == code), "")
        return f"abort {there}: {text}{code:08X}h"
    if command == (1 if request else 2):
        return f"{'write' if request else 'answer'} {there} = {_value(data)}"
    if request and command == 2:
        return f"read {there}"
    return f"written {there}" if not request and command == 3 else "segment or block"


def _value(data: bytes) -> str:
    """Of an expedited transfer; the size is given in bits 2 and 3 where bit 0 says so."""
    if not data[0] & 0x02:
        return "..."
    length = 4 - (data[0] >> 2 & 0x03) if data[0] & 0x01 else 4
    return f"{int.from_bytes(data[4 : 4 + length], 'little'):0{2 * length}X}h"


def _named(kind: type[NmtCommand] | type[NmtState], code: int) -> str:
    return kind(code).name.replace("_", " ").lower() if code in set(kind) else f"{code:02X}h"
