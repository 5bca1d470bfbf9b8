"""The base of a foreign format: a name, file endings, and the signals that a file contains."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import ClassVar

from drivetwin.recording.import_map import AxisMap, ImportMap
from drivetwin.recording.recording import Samples

Columns = dict[str, dict[str, Samples]]
"""Of each axis: samples (n,) by the name of the recording's column."""


@dataclass(frozen=True)
class Signals:
    """What a file holds: `time` (n,) [s], columns on the joint side, and the axes with all constants known.

    `files`: all that was read. `start`: the date and time at which `time` is 0, where the file tells. `repaired`: as in
    `Repaired.changes`.
    """

    time: Samples
    columns: Columns
    axes: dict[str, AxisMap]
    files: tuple[Path, ...]
    start: datetime | None = None
    repaired: dict[str, int] = field(default_factory=dict)


class ImportFormat(ABC):
    """One kind of file. A table of named columns is a `TableFormat`, which asks for less."""

    name: ClassVar[str]
    """As `format` in the map has it."""
    endings: ClassVar[tuple[str, ...]]
    """Of its files, as `.csv`; a map that says no `format` finds it by them."""

    @classmethod
    def recognises(cls, file: Path) -> bool | None:  # noqa: ARG003  # of the formats that look into it
        """Whether a file with one of its endings is of this format, where its first lines tell; None: the ending is enough."""
        return None

    @abstractmethod
    def signals(self, file: Path, import_map: ImportMap, *, mend: bool) -> Signals:
        """What the map names of a file; `mend`: repaired as `repair` does, where the format has rows to repair.

        Raises UserError naming the file, and the column and row where there is one.
        """
