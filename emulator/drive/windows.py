"""Windows with a time: a target counts as reached after long enough within its window (6067h/6068h, 606Dh to 6070h)."""

from __future__ import annotations


class Window:
    """Whether a value has been within (or beyond) a size for at least a time."""

    def __init__(self) -> None:
        self._elapsed = 0.0
        self.held = False

    def restart(self) -> None:
        """Forget how long it has held."""
        self._elapsed = 0.0
        self.held = False

    def look(self, holds: bool, time: float, cycle: float) -> bool:
        """`holds` for a cycle [s] that has passed; whether it has held for `time` [s] by now."""
        if not holds:
            self._elapsed = 0.0
            self.held = False
            return False
        self._elapsed += cycle
        self.held = self._elapsed >= time - 1e-9
        return self.held
