"""A hardware-in-the-loop bench without the hardware: `emulate`, `identify`, `diagnose`, ... as functions (docs/api.md)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drivetwin.api import Emulation, apply, diagnose, emulate, identify, import_recording, replay

__all__ = ["Emulation", "apply", "diagnose", "emulate", "identify", "import_recording", "replay"]


def __getattr__(name: str) -> Any:
    """The functions are imported when one of them is asked for: the command line starts without them."""
    if name in __all__:
        return getattr(import_module("drivetwin.api"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
