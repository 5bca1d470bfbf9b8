"""What `drivetwin import --repair` corrects: rows exported twice, single missing samples, and ends without numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.recording.recording import Samples, needed

Columns = dict[str, dict[str, Samples]]


@dataclass(frozen=True)
class Repaired:
    """`time` (n,) [s] and the columns as they are now.

    `changes`: samples filled in by column, repeated `rows` taken out, and `leading_rows` and `trailing_rows` cut off.
    """

    time: Samples
    columns: Columns
    changes: dict[str, int]

    def words(self) -> str:
        """What was changed, and where the cuts are; empty where nothing was."""
        places = {_LEADING: f"cut off before time {self.time[0]:g} s", _TRAILING: f"cut off after time {self.time[-1]:g} s"}
        return ", ".join(
            f"{count} row{'s' if count > 1 else ''} {places[what]}" if what in places else f"{count} of {what}"
            for what, count in self.changes.items()
        )


_LEADING, _TRAILING = "leading_rows", "trailing_rows"


def repair(time: Samples, columns: Columns) -> Repaired:
    """Take out rows that repeat the one before in time and in every column, fill in single NaN by a straight line over time.

    Then rows at both ends that have NaN as their time or in a required column are cut off. Any other NaN, or an infinity,
    stays as it is: what was there is not known.
    """
    kept = ~_repeats(time, columns)
    time = time[kept]
    found: Columns = {axis: {name: values[kept] for name, values in named.items()} for axis, named in columns.items()}
    changes = {"rows": int((~kept).sum())} if not kept.all() else {}
    for axis, named in found.items():
        for name in needed(named):
            single = _single(time, named[name])
            if single.size:
                named[name][single] = _between(time, named[name], single)
                changes[f"{axis}.{name}"] = int(single.size)
    span = _numbers(time, found)
    ends = {_LEADING: span.start, _TRAILING: len(time) - span.stop}
    found = {axis: {name: values[span] for name, values in named.items()} for axis, named in found.items()}
    return Repaired(time[span], found, changes | {what: count for what, count in ends.items() if count})


def _repeats(time: Samples, columns: Columns) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Rows (n,) that are the same as the one before, NaN beside NaN included."""
    same = np.zeros(len(time), dtype=np.bool_)
    same[1:] = time[1:] == time[:-1]
    for named in columns.values():
        for values in named.values():
            same[1:] &= (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    return same


def _single(time: Samples, values: Samples) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Indices of NaN between two finite values, one before it and one after it in time."""
    finite, rises = np.isfinite(values), np.diff(time) > 0.0
    return np.flatnonzero(np.isnan(values[1:-1]) & finite[:-2] & finite[2:] & rises[:-1] & rises[1:]) + 1


def _between(time: Samples, values: Samples, index: np.ndarray[tuple[int], np.dtype[np.intp]]) -> Samples:
    """On the straight lines between the neighbours of these samples, which need not be halfway: steps may be uneven."""
    before, after = index - 1, index + 1
    share = (time[index] - time[before]) / (time[after] - time[before])
    return values[before] + share * (values[after] - values[before])


def _numbers(time: Samples, columns: Columns) -> slice:
    """From the first to the last row with a time and a number in every required column; all rows where none has these."""
    has = ~np.isnan(time)
    for named in columns.values():
        for name in needed(named):
            has &= ~np.isnan(named[name])
    rows = np.flatnonzero(has)
    return slice(int(rows[0]), int(rows[-1]) + 1) if rows.size else slice(0, len(time))
