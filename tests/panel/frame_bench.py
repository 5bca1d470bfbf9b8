"""Frames as the panel's end of a bus hands them on, of identifiers and data."""

from __future__ import annotations

import can

from drivetwin.bus.unix_bus import pack
from drivetwin.panel.frames import Frames, Packet, frames_of


def frames(*told: tuple[int, bytes]) -> Frames:
    """Data frames, all at once."""
    messages = [can.Message(arbitration_id=identifier, data=data, is_extended_id=False) for identifier, data in told]
    return frames_of([Packet(0.0, pack(message)) for message in messages])
