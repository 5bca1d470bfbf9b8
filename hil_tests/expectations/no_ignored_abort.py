"""No SDO abort is ignored: the refused object is written later, or nothing moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import BusFrame, Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding

REQUEST, ANSWER = 0x600, 0x580
"""COB-IDs of the default SDO, less the node-ID (CiA 301, 7.3.3)."""

ABORT = 0x80
DOWNLOAD = 1
"""Client command specifier of an initiated download (CiA 301, 7.2.4.3.3)."""
DONE = 3
"""Server command specifier of an initiated download."""


class _Write(NamedTuple):
    time: float
    object: bytes
    abort_code: int | None


@dataclass(frozen=True)
class NoIgnoredAbort(Expectation):
    """For each write that a node aborts: a later write of the same object that it takes, or no drive is enabled afterwards."""

    name: ClassVar[str] = "no_ignored_abort"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        enabled = [change.time for change in evidence.states if change.after is State.OPERATION_ENABLED]
        finding = MET
        for axis, node in zip(evidence.axes, evidence.nodes, strict=True):
            writes = list(_writes(evidence.frames, node))
            for place, write in enumerate(writes):
                code = write.abort_code
                if code is None or all(time < write.time for time in enabled):
                    continue
                if any(later.object == write.object and later.abort_code is None for later in writes[place:]):
                    continue
                index, subindex = int.from_bytes(write.object[:2], "little"), write.object[2]
                finding += self.fails(
                    f"node {node} refused to write {index:04X}h:{subindex:02X} (abort {code:08X}h), and drives were enabled "
                    "nevertheless",
                    axis,
                    write.time,
                )
        return finding


def _writes(frames: tuple[BusFrame, ...], node: int) -> Iterator[_Write]:
    """Initiated downloads of a node, with what it answered."""
    asked: bytes | None = None
    for frame in frames:
        if len(frame.data) < 8:
            continue
        if frame.identifier == REQUEST + node:
            asked = frame.data[1:4] if frame.data[0] >> 5 == DOWNLOAD else None
        elif frame.identifier == ANSWER + node and asked is not None and frame.data[1:4] == asked:
            if frame.data[0] == ABORT:
                yield _Write(frame.time, asked, int.from_bytes(frame.data[4:8], "little"))
            elif frame.data[0] >> 5 == DONE:
                yield _Write(frame.time, asked, None)
            asked = None
