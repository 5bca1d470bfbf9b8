"""A node that does not belong to the machine is left alone: what it moves is unknown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import BusFrame, Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding

NMT, SDO_REQUEST, HEARTBEAT = 0x000, 0x600, 0x700
"""COB-IDs (CiA 301, 7.3.3), of the last two less the node-ID."""

RPDOS = (0x200, 0x300, 0x400, 0x500)

START, EVERY_NODE = 0x01, 0

WRITES = (0x20, 0xC0)
"""Command specifiers of SDO requests that begin to write an object, at once or in a block (CiA 301, 7.2.4.3); to read what a
node is does not command it."""


@dataclass(frozen=True)
class NoStranger(Expectation):
    """Once a node boots or beats that the machine has not, the controller gives it no set-point, writes nothing to it, and
    sends it no NMT command; nor does it start every node at once."""

    name: ClassVar[str] = "no_stranger"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        strangers: set[int] = set()
        told: set[int] = set()
        finding = MET
        for frame in evidence.frames:
            node = frame.identifier - HEARTBEAT
            if not frame.by_controller:
                if 0 < node < 0x80 and node not in evidence.nodes:
                    strangers.add(node)
                continue
            for stranger in sorted(strangers - told):
                if _commands(frame, stranger):
                    told.add(stranger)
                    finding += self.fails(f"node {stranger} is none of the machine's and is commanded", None, frame.time)
        return finding


def _commands(frame: BusFrame, node: int) -> bool:
    if frame.identifier == NMT:
        return frame.data[1:2] == bytes((node,)) or frame.data == bytes((START, EVERY_NODE))
    if frame.identifier == SDO_REQUEST + node:
        return frame.data[:1] != b"" and frame.data[0] & 0xE0 in WRITES
    return frame.identifier in [rpdo + node for rpdo in RPDOS]
