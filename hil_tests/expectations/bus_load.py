"""The bus load on a physical bus stays below its capacity in any interval."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from drivetwin.bus.timing.frame_bits import Frame
from drivetwin.bus.timing.load import MICROSECONDS, Load, LoggedFrame
from drivetwin.bus.timing.services import AT_LEISURE
from drivetwin.hil_tests.evidence import BusFrame, Evidence
from drivetwin.hil_tests.expectations.base import Expectation, Finding, limit


@dataclass(frozen=True)
class BusLoad(Expectation):
    """Truly stuffed bits of the worst `window` [s] from the first SYNC on, as a share of the bench's bit rate: at most `share`.

    Without `waiting` the services whose sender waits for an answer (SDO, NMT, LSS) are left out: in lockstep they take no time,
    and a whole configuration would fall into one instant.
    """

    name: ClassVar[str] = "bus_load"
    needs_truth: ClassVar[bool] = False

    share: float = field(metadata=limit("bus_load"))
    window: float = 0.1
    waiting: bool = True

    def judge(self, evidence: Evidence) -> Finding:
        frames = _from_first_sync(evidence.frames)
        if not frames or frames[0].stamp == frames[-1].stamp:
            return self.fails("there was no SYNC by which time passed", None, evidence.end)
        load = Load(frames)
        worst = load.worst(self.window, without=frozenset() if self.waiting else AT_LEISURE)
        rate = evidence.bench.bit_rate
        message = f"the bus is too full at {rate / 1e3:g} kbit/s, in the {1e3 * self.window:g} ms from there on"
        return self.at_most("bus load", worst.load(rate), self.share, "1", message, None, worst.start)


def _from_first_sync(frames: tuple[BusFrame, ...]) -> list[LoggedFrame]:
    first = next((place for place, frame in enumerate(frames) if frame.identifier == 0x80), len(frames))
    return [
        LoggedFrame(round(frame.time * MICROSECONDS), Frame(frame.identifier, frame.data, frame.requested))
        for frame in frames[first:]
        if frame.identifier <= 0x7FF
    ]
