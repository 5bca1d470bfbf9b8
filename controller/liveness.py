"""Whether a node is alive, and its NMT state, from boot-up messages and heartbeats (CiA 301, 7.2.8.3.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

BASE_COB_ID = 0x700
"""COB-ID of boot-up and heartbeat, less the node-ID."""

BOOT_UP, OPERATIONAL = 0x00, 0x05

TOGGLE = 0x80

NMT_STATES = {0x04: "stopped", 0x05: "operational", 0x7F: "pre-operational"}


@dataclass
class Liveness:
    """What a node has told of itself.

    `boots` are boot-up messages since somebody began to count, `beats` heartbeats; `state` is the NMT state of the last one.
    `silence` is counted by who runs the cycles [s], and only where the node was told to beat (`expected`).
    """

    boots: int = 0
    beats: int = 0
    state: int | None = None
    silence: float = 0.0
    expected: bool = False

    def take(self, data: bytes) -> None:
        """A boot-up message or a heartbeat; one of another length is none."""
        if len(data) != 1:
            return
        self.silence = 0.0
        if data[0] == BOOT_UP:
            self.boots += 1
            self.state = None
        else:
            self.beats += 1
            self.state = data[0] & ~TOGGLE

    def begin(self) -> None:
        """Count anew."""
        self.boots = self.beats = 0
        self.state = None
        self.silence = 0.0
