"""All modes of operation: one file each in this folder, and those of installed packages."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from drivetwin.emulator.drive.mode import Mode
from drivetwin.foundation.plugins import Plugins

MODES: Plugins[Mode] = Plugins(
    "mode", Mode, "drivetwin.emulator.drive", "drivetwin.modes", "emulator/drive/mode.py", key="code"
)


@cache
def modes() -> Mapping[int, type[Mode]]:
    """Every mode by its code of 6060h."""
    return MODES.found()
