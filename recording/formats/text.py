"""What any text file of numbers is made of: its encoding, and numbers as they are written."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from drivetwin.foundation.errors import UserError

Decimal = Literal[".", ","]


@dataclass(frozen=True)
class Spelling:
    """How a number is written: its decimal sign, and what groups its digits by three; empty where nothing does."""

    decimal: Decimal
    thousands: str = ""

    def plain(self, cell: str) -> str:
        """The cell with a decimal point and no groups; empty where it is written otherwise."""
        if self.thousands:
            groups = re.escape(self.thousands)
            if re.match(rf"[-+]?\d{{1,3}}(?:{groups}\d{{3}})+(?!\d|{groups})", cell):
                cell = cell.replace(self.thousands, "")
        if self.decimal == ",":
            return cell.replace(",", ".") if "." not in cell else ""
        return cell


def decoded(file: Path, encoding: str | None) -> str:
    """The text of `file`: as told, else by its byte order mark, else UTF-8, else Windows-1252."""
    try:
        raw = file.read_bytes()
    except OSError as error:
        raise UserError(f"{file} cannot be read: {error.strerror or error}") from error
    marks = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
    found = next((name for mark, name in marks if raw.startswith(mark)), None)
    try:
        if encoding or found:
            return raw.decode(encoding or found or "utf-8")
        try:
            return raw.decode("utf-8")
        except UnicodeDecodeError:
            return raw.decode("cp1252")
    except (LookupError, UnicodeDecodeError) as error:
        raise UserError(f"{file} cannot be decoded: {error}; give csv.encoding in the map") from error


_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf|infinity)", re.IGNORECASE)


def number(cell: str, spelling: Spelling) -> float | None:
    """The number in a cell, NaN where it is empty, None where it is text."""
    if not cell:
        return float("nan")
    cell = spelling.plain(cell)
    return float(cell) if _NUMBER.fullmatch(cell) else None


def is_number(cell: str, spelling: Spelling) -> bool:
    return bool(cell) and number(cell, spelling) is not None
