"""MATLAB .mat files (up to v7) as tables: variables, and fields of structs by their dotted path."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.formats.table_format import TableFormat
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.in_child import UnreadableError, read_in_child
from drivetwin.recording.recording import Samples
from drivetwin.recording.table import Column, Table

_HDF5 = b"MATLAB 7.3 MAT-file"


class Matlab(TableFormat):
    """MATLAB files; a column is a variable."""

    name: ClassVar[str] = "matlab"
    endings: ClassVar[tuple[str, ...]] = (".mat",)

    def table(self, file: Path, import_map: ImportMap) -> Table:
        return read_matlab(file)


def read_matlab(file: Path) -> Table:
    """Every numeric vector in `file`: `t`, `run.q`, and the columns of a matrix as `X(:,2)`.

    Raises UserError for a v7.3 file (HDF5) and for what is no .mat file.
    """
    try:
        with file.open("rb") as stream:
            head = stream.read(len(_HDF5))
        if head == _HDF5:
            raise UserError(
                f"{file} is a MATLAB v7.3 (HDF5) file, which is not read; in MATLAB: s = load('{file.name}'); "
                f"save('{file.stem}_v7.mat', '-struct', 's', '-v7'), and import that"
            )
        vectors = read_in_child("matlab", file)
    except (OSError, UnreadableError) as error:
        raise UserError(f"{file} cannot be read as a MATLAB file: {error}; save it again with -v7") from error
    return Table(file, tuple(_column(name, values) for name, values in vectors.items()))


def _column(name: str, array: np.ndarray[Any, np.dtype[Any]]) -> Column:
    def read() -> Samples:
        return np.ascontiguousarray(array, dtype=np.float64)

    return Column(name, None, read)
