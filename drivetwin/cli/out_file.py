"""`--out FILE`: refused before the work where it could not be written after it."""

from __future__ import annotations

import os
from pathlib import Path

from drivetwin.foundation.errors import UserError


def refuse_out_file(out: Path, example: str) -> None:
    """Raise UserError where `out` is a directory or stands in a place that cannot be written."""
    if out.is_dir():
        raise UserError(f"{out} is a directory; --out names the file to write, for example {out / example}")
    existing = next(parent for parent in out.absolute().parents if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK):
        raise UserError(f"{out} cannot be written: {existing} is no directory that may be written to; choose another --out")
