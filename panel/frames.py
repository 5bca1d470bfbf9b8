"""Frames as the panel takes them: many at once, as arrays, so that ten thousand a second cost little."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivetwin.bus.unix_bus import ERROR, EXTENDED, REMOTE

Samples = NDArray[np.float64]
Places = NDArray[np.intp]

_CAN_FRAME = np.dtype([("identifier", "=u4"), ("length", "u1"), ("padding", "V3"), ("data", "u1", (8,))])
"""struct can_frame (linux/can.h)."""

_NONE = np.empty(0, np.intp)


@dataclass(frozen=True)
class Packet:
    """One or more struct can_frame as they came together, `stamp` [s]; `own`: the panel sent them."""

    stamp: float
    frames: bytes
    own: bool = False


@dataclass(frozen=True)
class Frames:
    """In the order in which they passed, n classic frames of 11-bit identifiers.

    `times` (n,) [s], `identifiers` (n,), `lengths` (n,) [byte], `data` (n, 8), zeros behind the length, `remote` and `own`
    (n,): remote frames, and those that the panel sent.
    """

    times: Samples
    identifiers: NDArray[np.uint32]
    lengths: NDArray[np.uint8]
    data: NDArray[np.uint8]
    remote: NDArray[np.bool_]
    own: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.times)

    def of(self, identifier: int) -> Places:
        """Where the data frames of an identifier stand."""
        return self.places.get(identifier, _NONE)

    def content(self, place: int) -> bytes:
        """Data of one frame."""
        return self.data[place, : self.lengths[place]].tobytes()

    @cached_property
    def places(self) -> dict[int, Places]:
        """Where the data frames of each identifier stand."""
        whole = np.flatnonzero(~self.remote)
        order = whole[np.argsort(self.identifiers[whole], kind="stable")]
        found, starts = np.unique(self.identifiers[order], return_index=True)
        return dict(zip(found.tolist(), np.split(order, starts[1:]), strict=True)) if len(order) else {}


def frames_of(packets: Iterable[Packet]) -> Frames:
    """What packets carry; error frames, frames of 29 bits and those of more than 8 bytes are left out."""
    packets = list(packets)
    raw = np.frombuffer(b"".join(each.frames for each in packets), _CAN_FRAME)
    counts = [len(each.frames) // _CAN_FRAME.itemsize for each in packets]
    times = np.repeat([each.stamp for each in packets], counts)
    own = np.repeat([each.own for each in packets], counts)
    taken = (raw["identifier"] & (ERROR | EXTENDED) == 0) & (raw["length"] <= 8)
    identifiers, lengths, data = raw["identifier"][taken], raw["length"][taken], raw["data"][taken]
    remote = identifiers & REMOTE != 0
    beyond = (np.arange(8) >= lengths[:, None]) | remote[:, None]
    return Frames(times[taken], identifiers & 0x7FF, lengths, np.where(beyond, 0, data).astype(np.uint8), remote, own[taken])
