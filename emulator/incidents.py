"""Events that strike a mechanism while it runs: rising friction, a sudden load, a wrong encoder sample."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.emulator.mechanism import Mechanism


@dataclass(frozen=True)
class _Rubbing:
    """Friction that rises from 0 at `begun` [s] to `torque` [N·m or N] in proportion to time, within `over` [s]."""

    torque: float
    begun: float
    over: float

    @property
    def full(self) -> float:
        """When it is there wholly [s]."""
        return self.begun + self.over

    def at(self, time: float) -> float:
        """[N·m or N]."""
        return self.torque if time >= self.full else self.torque * (time - self.begun) / self.over


class Incidents:
    """Changes of one mechanism beside what it is built as; axes by their numbers, several causes on one axis add up.

    `rising` is looked at once a cycle. `misreadings` (n,) [rad] are what the encoders are off by in the last period of the
    coming cycle, and 0 after it.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._laws = [axis.friction for axis in mechanism.dynamics.values()]
        self._rubbing: list[dict[Hashable, _Rubbing]] = [{} for _ in self._laws]
        self._loads: list[dict[Hashable, float]] = [{} for _ in self._laws]
        self.rising = False
        self.misreadings = np.zeros(len(self._laws))

    def rub(self, axis: int, cause: Hashable, torque: float, over: float) -> None:
        """Let coulomb friction and stiction rise by `torque` [N·m or N] within `over` [s]; a step at each cycle."""
        self._rubbing[axis][cause] = _Rubbing(torque, float(self._mechanism.data.time), over)
        self.rising = True

    def smooth(self, axis: int, cause: Hashable) -> None:
        """Take away the friction that a cause brought."""
        self._rubbing[axis].pop(cause, None)
        self.rising = True

    def raise_friction(self) -> None:
        """Let the friction be what it is now."""
        time = float(self._mechanism.data.time)
        self.rising = any(rubbing.full > time for causes in self._rubbing for rubbing in causes.values())
        for axis, (law, causes) in enumerate(zip(self._laws, self._rubbing, strict=True)):
            more = sum(rubbing.at(time) for rubbing in causes.values())
            self._mechanism.set_friction(
                axis, replace(law, coulomb=law.coulomb + more, static_torque=law.static_torque + more)
            )

    def load(self, axis: int, cause: Hashable, mass: float) -> None:
        """Let a point mass [kg] ride on the outermost body that an axis moves, at its centre of mass."""
        self._loads[axis][cause] = mass
        self._mechanism.set_load(axis, sum(self._loads[axis].values()))

    def unload(self, axis: int, cause: Hashable) -> None:
        """Take away the mass that a cause brought."""
        self._loads[axis].pop(cause, None)
        self._mechanism.set_load(axis, sum(self._loads[axis].values()))

    def misread(self, axis: int, angle: float) -> None:
        """Let the encoder be off by a motor angle [rad] in the last period of the coming cycle."""
        self.misreadings[axis] = angle
