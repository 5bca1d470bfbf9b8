"""What `drivetwin import --repair` corrects: rows exported twice, and single missing samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.recording.recording import Samples, needed

Columns = dict[str, dict[str, Samples]]


@dataclass(frozen=True)
class Repaired:
    """`time` (n,) [s] and the columns as they are now; `changes`: samples filled in by column, and `rows` taken out."""

    time: Samples
    columns: Columns
    changes: dict[str, int]


def repair(time: Samples, columns: Columns) -> Repaired:
    """Take out rows that repeat the one before in time and in every column, then fill in single NaN by a straight line.

    A NaN whose neighbours are not both finite, or an infinity, stays as it is: what was there is not known.
    """
    kept = ~_repeats(time, columns)
    time = time[kept]
    found: Columns = {axis: {name: values[kept] for name, values in named.items()} for axis, named in columns.items()}
    changes = {"rows": int((~kept).sum())} if not kept.all() else {}
    for axis, named in found.items():
        for name in needed(named):
            single = _single(named[name])
            if single.size:
                named[name][single] = (named[name][single - 1] + named[name][single + 1]) / 2.0
                changes[f"{axis}.{name}"] = int(single.size)
    return Repaired(time, found, changes)


def _repeats(time: Samples, columns: Columns) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Rows (n,) that are the same as the one before, NaN beside NaN included."""
    same = np.zeros(len(time), dtype=np.bool_)
    same[1:] = time[1:] == time[:-1]
    for named in columns.values():
        for values in named.values():
            same[1:] &= (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    return same


def _single(values: Samples) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Indices of NaN between two finite values."""
    finite = np.isfinite(values)
    return np.flatnonzero(np.isnan(values[1:-1]) & finite[:-2] & finite[2:]) + 1
