"""Everything that can go wrong on a machine or its bus during motion: every axis must stop, and the cause is named."""

from __future__ import annotations

from drivetwin.foundation.errors import UserError


class TroubleError(UserError):
    """Trouble of the node `node` (None: of no single one), which told the error code `emcy` (None: it told none)."""

    def __init__(self, message: str, node: int | None = None, emcy: int | None = None) -> None:
        super().__init__(message)
        self.node = node
        self.emcy = emcy


class DriveFaultError(TroubleError):
    """A drive has left operation by itself, or told an emergency."""
