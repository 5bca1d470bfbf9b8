"""MATLAB .mat files (up to v7) as tables: variables, and fields of structs by their dotted path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, matlab

from drivetwin.errors import UserError
from drivetwin.recording.recording import Samples
from drivetwin.recording.table import Column, Table


def read_matlab(file: Path) -> Table:
    """Every numeric vector in `file`: `t`, `run.q`, and the columns of a matrix as `X(:,2)`.

    Raises UserError for a v7.3 file (HDF5) and for what is no .mat file.
    """
    try:
        content = loadmat(str(file), simplify_cells=True)
    except NotImplementedError as error:
        raise UserError(
            f"{file} is a MATLAB v7.3 (HDF5) file, which is not read; in MATLAB: s = load('{file.name}'); "
            f"save('{file.stem}_v7.mat', '-struct', 's', '-v7'), and import that"
        ) from error
    except (OSError, ValueError, TypeError, matlab.MatReadError) as error:
        raise UserError(f"{file} cannot be read as a MATLAB file: {error}; save it again with -v7") from error
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    return Table(file, tuple(_vectors("", variables)))


def _vectors(prefix: str, value: Any) -> Iterator[Column]:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _vectors(f"{prefix}.{name}" if prefix else str(name), inner)
        return
    array = np.squeeze(np.asarray(value))
    if array.dtype.kind not in "buif":
        return
    if array.ndim == 1:
        yield _column(prefix, array)
    elif array.ndim == 2:
        along_rows = array.shape[0] >= array.shape[1]
        for number in range(array.shape[1] if along_rows else array.shape[0]):
            name = f"{prefix}(:,{number + 1})" if along_rows else f"{prefix}({number + 1},:)"
            yield _column(name, array[:, number] if along_rows else array[number])


def _column(name: str, array: np.ndarray[Any, np.dtype[Any]]) -> Column:
    def read() -> Samples:
        return np.ascontiguousarray(array, dtype=np.float64)

    return Column(name, None, read)
