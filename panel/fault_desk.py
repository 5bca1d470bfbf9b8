"""Faults by hand: struck and ended through the emulator's control socket, as by any other client of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivetwin.foundation.control_socket import ask_control
from drivetwin.foundation.errors import UserError
from drivetwin.panel.bus_time import BusTime
from drivetwin.panel.happenings import PANEL, Happenings

MOST_STRUCK = 50


@dataclass(frozen=True)
class Struck:
    """A fault as it was asked for, `at` [s] of the bus; `ended` [s], None while it lasts or where it strikes once."""

    told: dict[str, object]
    at: float
    lasts: bool
    ended: float | None = None


class FaultDesk:
    """What this panel has struck, the last first. `control` is None where it has emulated nothing."""

    def __init__(self, control: Path | None, time: BusTime, happenings: Happenings) -> None:
        self._control = control
        self._time = time
        self._happenings = happenings
        self._kinds: dict[str, Any] = {}
        self.struck: list[Struck] = []

    def kinds(self) -> dict[str, Any]:
        """Every fault with its parameters, as the emulator lists them. Raises UserError."""
        self._kinds = self._kinds or ask_control(self._emulator(), {"list": {}})["faults"]
        return self._kinds

    def strike(self, told: dict[str, object], seconds: float | None) -> None:
        """Let it happen. Raises UserError with the emulator's reason."""
        lasts = bool(self.kinds().get(str(told.get("fault")), {}).get("lasts"))
        at = self._time.now
        ask_control(self._emulator(), {"strike": told} if seconds is None else {"strike": told, "for": seconds})
        self.struck.insert(0, Struck(told, at, lasts and seconds is None))
        del self.struck[MOST_STRUCK:]
        self._happenings.note(PANEL, str(told.get("node")), f"struck {told['fault']}", at)

    def end(self, told: dict[str, object]) -> None:
        """Take its cause away. Raises UserError with the emulator's reason."""
        ask_control(self._emulator(), {"end": told})
        now = self._time.now
        self.struck = [
            Struck(one.told, one.at, one.lasts, now) if one.told == told and one.lasts and one.ended is None else one
            for one in self.struck
        ]
        self._happenings.note(PANEL, str(told.get("node")), f"ended {told['fault']}")

    def _emulator(self) -> Path:
        if self._control is None:
            raise UserError("faults are for an emulator, and this panel has started none; try drivetwin panel --emulate scara")
        return self._control
