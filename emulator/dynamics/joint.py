"""What a joint has beyond the model in MuJoCo's own parameters: the plant steps it itself, a replay adds it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Joint:
    """Torque = inertia q'' + stiffness q - pull [N·m or N], `inertia` on the motor's side of the transmission."""

    inertia: float = 0.0
    stiffness: float = 0.0
    pull: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether there is any."""
        return any((self.inertia, self.stiffness, self.pull))
