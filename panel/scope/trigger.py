"""When a scope stops by itself: a channel passes a level, or a drive enters a state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from drivetwin.panel.frames import Samples
from drivetwin.panel.power_states import power_state


@dataclass(frozen=True)
class Trigger:
    """`level` is in the channel's shown unit; `state` is that of CiA 402, told by a channel of 6041h."""

    channel: str
    kind: Literal["rises", "falls", "state"]
    level: float = 0.0
    state: str = ""

    def fires(self, values: Samples) -> int | None:
        """The place of the first of `values` (n,) to which the step from the one before is what is waited for."""
        before, now = values[:-1], values[1:]
        match self.kind:
            case "rises":
                steps = (before < self.level) & (self.level <= now)
            case "falls":
                steps = (before > self.level) & (self.level >= now)
            case "state":
                steps = before != now
        places = (np.flatnonzero(steps) + 1).tolist()
        return next((place for place in places if self.kind != "state" or self._enters(values, place)), None)

    def _enters(self, values: Samples, place: int) -> bool:
        return power_state(int(values[place])) == self.state != power_state(int(values[place - 1]))
