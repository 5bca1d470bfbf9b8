"""A foreign file as a table: named columns, read only when asked for."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Samples


@dataclass(frozen=True)
class Column:
    """One column: `unit` as the file names it, None where it does not; `read` gives (n,) or raises UserError.

    `instants` gives its cells as dates and times, where the file is text.
    """

    name: str
    unit: str | None
    read: Callable[[], Samples]
    instants: Callable[[], list[datetime]] | None = None


@dataclass(frozen=True)
class Table:
    """The columns of one file, in its order."""

    file: Path
    columns: tuple[Column, ...]

    def find(self, key: str | int) -> Column | None:
        """The column by name or by number (counted from 1), None where there is none.

        A name matches with or without the unit in brackets. Raises UserError where it fits several.
        """
        if isinstance(key, int):
            return self.columns[key - 1] if 1 <= key <= len(self.columns) else None
        wanted = key.strip()
        exact = [column for column in self.columns if column.name == wanted]
        found = exact or [column for column in self.columns if _bare(column.name) == wanted]
        if len(found) > 1:
            those = {id(column) for column in found}
            numbers = [str(number) for number, column in enumerate(self.columns, start=1) if id(column) in those]
            raise UserError(
                f"{self.file}: {key!r} names columns {', '.join(numbers)}; give the number in the map instead"
            )
        return found[0] if found else None

    def column(self, key: str | int, wanted_for: str) -> Column:
        """As `find`, but a missing column is a UserError naming column, file and what columns there are."""
        found = self.find(key)
        if found is None:
            names = [column.name for column in self.columns if column.name]
            close = difflib.get_close_matches(str(key), names, n=1)
            hint = f" (did you mean {close[0]!r}?)" if close else ""
            raise UserError(
                f"{self.file}: no column {key!r} for {wanted_for}{hint}; the columns are: {self._listing()}; "
                "correct the map, or say `optional: true` there if some files lack it"
            )
        return found

    def _listing(self, most: int = 40) -> str:
        names = [column.name or f"(number {number})" for number, column in enumerate(self.columns, start=1)]
        return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "") or "none"


def _bare(name: str) -> str:
    """`Speed [rpm]` as `Speed`."""
    head, bracket, _ = name.partition("[")
    return head.strip() if bracket and head.strip() else name
