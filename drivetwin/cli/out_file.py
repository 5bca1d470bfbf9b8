"""`--out FILE`: refused before the work where it could not be written after it."""

from __future__ import annotations

from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import refuse_unwritable


def refuse_out_file(out: Path, example: str) -> None:
    """Raise UserError where `out` is a directory or stands in a place that cannot be written."""
    if out.is_dir():
        raise UserError(f"{out} is a directory; --out names the file to write, for example {out / example}")
    refuse_unwritable(out)
