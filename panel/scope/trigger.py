"""When a scope stops by itself: a channel passes a level, or a drive enters a state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from drivetwin.panel.power_states import power_state


@dataclass(frozen=True)
class Trigger:
    """`level` is in the channel's shown unit; `state` is that of CiA 402, told by a channel of 6041h."""

    channel: str
    kind: Literal["rises", "falls", "state"]
    level: float = 0.0
    state: str = ""

    def fires(self, before: float, now: float) -> bool:
        """Whether the step from one sample to the next is what is waited for."""
        match self.kind:
            case "rises":
                return before < self.level <= now
            case "falls":
                return before > self.level >= now
            case "state":
                return power_state(int(now)) == self.state != power_state(int(before))
