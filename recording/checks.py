"""The checks of the recording contract: each names the file, the column and the row, and says what to do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import FIRST_SCHEMA, ONE_OF, SCHEMA, TORQUE, WITHOUT_TORQUE, Recording, Samples

TOLERANCE = 0.01
GAP_FACTOR = 1.5  # a step beyond this many periods means that samples are missing, not that the clock jitters


@dataclass(frozen=True)
class Advice:
    """What to do about a `missing` number, and about time that does not `rise`."""

    missing: str
    rise: str


UNREPAIRED = Advice(
    "record or export it again, cut the recording before it, or, where `drivetwin import` wrote it, import it with --repair",
    "sort the rows, or take the repeated ones out (import --repair)",
)
REPAIRED = Advice("export it again, or cut the recording before it", "sort the rows, and take out those of the same time")
"""Where --repair has done what it can."""


def check_lengths(where: str, time: Samples, columns: Mapping[str, Samples]) -> None:
    """Every column is as long as `time`; raises UserError naming the first that is not."""
    for name, values in columns.items():
        if len(values) != len(time):
            raise UserError(
                f"{where}: column {name} has {len(values)} values, time has {len(time)}; it ends at row {len(values)}; "
                "every column needs one value a sample: export it again"
            )


def check_required(where: str, axis: str, names: Iterable[str], schema: str = SCHEMA) -> None:
    """Axis `axis` has torque, and position or velocity; or without torque position and demand, which recording/1 does not know.

    `names` are its columns without the axis. Raises UserError naming the column that is missing.
    """
    present = set(names)
    if TORQUE in present:
        if not present & set(ONE_OF):
            wanted = " or ".join(f"{axis}.{name}" for name in ONE_OF)
            raise UserError(
                f"{where}: one of {wanted} is required and both are missing (from row 1 on); {_have(axis, present)}"
            )
        return
    lacking = [f"{axis}.{name}" for name in WITHOUT_TORQUE if name not in present]
    if schema == FIRST_SCHEMA:
        raise UserError(
            f"{where}: required column {axis}.{TORQUE} is missing (from row 1 on); {_have(axis, present)}, or write "
            f"it as {SCHEMA}, which needs no torque beside {axis}.position and {axis}.position_demand"
        )
    if lacking:
        raise UserError(
            f"{where}: column {axis}.{TORQUE} is missing (from row 1 on), and without it {' and '.join(lacking)} "
            f"is required too; {_have(axis, present)}"
        )


def check_torque(recording: Recording, purpose: str) -> None:
    """Every axis has its torque, which `purpose` needs; raises UserError naming the axis that has none."""
    for axis, columns in recording.columns.items():
        if TORQUE not in columns:
            where = recording.files[-1] if recording.files else recording.name
            raise UserError(
                f"{where}: column {axis}.{TORQUE} is missing (from row 1 on), which {purpose} needs; record it, or "
                "take the axis out of recording.json"
            )


def _have(axis: str, present: set[str]) -> str:
    if not present:
        return "no column is of this axis; correct its name in recording.json, or take the axis out"
    columns = ", ".join(f"{axis}.{name}" for name in sorted(present))
    return f"columns of this axis: {columns}; record it, or take the axis out of recording.json"


def check_finite(where: str, column: str, values: Samples, time: Samples, advice: Advice = UNREPAIRED) -> None:
    """No NaN or infinity in `values`; raises UserError naming the first row that has one."""
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        index = int(bad[0])
        more = f" ({bad.size} such rows)" if bad.size > 1 else ""
        at = f", time {time[index]:g} s" if np.isfinite(time[index]) else ""
        raise UserError(
            f"{where}: column {column} is {values[index]} at row {index + 1}{at}{more}; a required column needs a "
            f"finite number in every row: {advice.missing}"
        )


def gaps(where: str, time: Samples, period: float, advice: Advice = UNREPAIRED) -> list[int]:
    """Indices i where samples are missing between i - 1 and i.

    `time` is (n,) [s], `period` [s]. Raises UserError where time does not rise, or where a step is neither within 1 %
    of the period nor a gap.
    """
    check_finite(where, "time", time, time, advice)
    if len(time) < 2:
        raise UserError(f"{where}: column time has {len(time)} row(s), a recording needs at least 2; export it again")
    steps = np.diff(time)
    # Two roundings of a large time stamp are no jitter.
    slack = TOLERANCE * period + 4 * float(np.spacing(np.max(np.abs(time))))
    uneven = np.flatnonzero(np.abs(steps - period) > slack)
    for index in uneven:
        if steps[index] <= 0 or steps[index] < GAP_FACTOR * period:
            raise UserError(_uneven_message(where, time, int(index), period, float(np.median(steps)), advice))
    return [int(index) + 1 for index in uneven]


def _uneven_message(where: str, time: Samples, index: int, period: float, median: float, advice: Advice) -> str:
    row, step = index + 2, time[index + 1] - time[index]
    if step <= 0:
        return (
            f"{where}: column time falls or stands still at row {row} ({time[index]:g} s, then {time[index + 1]:g} s); "
            f"time must rise in equal steps: {advice.rise}"
        )
    if abs(median - period) > TOLERANCE * period:
        return (
            f"{where}: column time steps by {median:g} s (row {row}) where sample_period says {period:g} s; "
            "correct sample_period in recording.json, or give time in seconds"
        )
    return (
        f"{where}: column time steps by {step:g} s at row {row} where {period:g} s is expected (1 % tolerance); "
        "time must rise in equal steps: resample it (`resample:` in an import map)"
    )


def refuse_gap(where: str, time: Samples, index: int, period: float) -> UserError:
    """The error for a gap before sample `index`."""
    step = time[index] - time[index - 1]
    return UserError(
        f"{where}: column time has a gap of {step:g} s before row {index + 1} (time {time[index]:g} s), about "
        f"{round(step / period) - 1:.6g} samples of {period:g} s are lost; record again, or split there with --allow-gaps"
    )


def check_joints(recording: Recording, joint_names: Iterable[str]) -> None:
    """Every axis of the recording moves a joint of the model; raises UserError naming the axis that does not."""
    known = list(joint_names)
    for axis, info in recording.info.axes.items():
        if info.joint not in known:
            where = recording.files[0] if recording.files else recording.name
            raise UserError(
                f"{where}: axis {axis} (columns {axis}.*, from row 1 on) belongs to joint {info.joint!r}, which the "
                f"model does not have; its joints: {', '.join(known) or 'none'}; correct `joint` in recording.json "
                "or take the model of this machine"
            )
