"""Foreign files to recordings: what their format reads, resampled to equal steps, checked by the contract."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from drivetwin.foundation.errors import UserError
from drivetwin.recording.checks import GAP_FACTOR, REPAIRED, TOLERANCE, UNREPAIRED, gaps, refuse_gap
from drivetwin.recording.formats.base import Signals
from drivetwin.recording.formats.library import format_of
from drivetwin.recording.import_map import AxisMap, ImportMap
from drivetwin.recording.recording import COLUMNS, AxisInfo, Recording, RecordingInfo, Samples

logger = logging.getLogger(__name__)

_FINEST = 1000
"""Into how many parts a step of a file may be resampled."""


def import_recordings(
    files: Sequence[Path],
    import_map: ImportMap,
    *,
    mend: bool = False,
    done: Callable[[Path], None] | None = None,
) -> list[Recording]:
    """One recording a file, in their order, named by the file's stem (made unique by the folders above it).

    `mend`: as in `import_recording`. `done` is called with each file that is through. Raises UserError naming file, column
    and row.
    """
    recordings = []
    for file, name in zip(files, unique_names(files), strict=True):
        recordings.append(import_recording(file, import_map, name=name, mend=mend))
        if done is not None:
            done(file)
    return recordings


def import_recording(file: Path, import_map: ImportMap, *, name: str | None = None, mend: bool = False) -> Recording:
    """The recording in `file`; its `files` are what it was made of: the file, the map, and an EDS where one was read.

    `mend`: a table's repeated rows, single missing samples and ends without numbers are repaired (`repair`), and `repaired`
    says how many.
    Raises UserError for a file, a column or a unit that does not fit the map, and for what a recording may not be.
    """
    if not file.is_file():
        raise UserError(f"{file} does not exist; give the files to import")
    signals = format_of(file, import_map).signals(file, import_map, mend=mend)
    signals = _on_equal_steps(file, signals, import_map)
    period = import_map.resample or _period(signals.time)
    starts = gaps(str(file), signals.time, period, REPAIRED if mend else UNREPAIRED)
    if starts and import_map.gaps == "refuse":
        error = refuse_gap(str(file), signals.time, starts[0], period)
        raise UserError(f"{str(error).partition('; record again')[0]}; record again, or say `gaps: keep` in the map")
    derived = _integrate_positions(signals, starts)
    info = _info(import_map, signals, period, derived)
    return Recording(name or file.stem, info, signals.time, signals.columns, files=signals.files)


def unique_names(files: Sequence[Path]) -> list[str]:
    """File stems; where they are the same, with as many parent folders before them as it takes.

    Raises UserError where a file is given twice.
    """
    paths = [file.absolute() for file in files]
    for path, count in Counter(paths).items():
        if count > 1:
            raise UserError(f"{path} is given twice; give every file once")
    names = [path.stem for path in paths]
    for depth in range(1, max((len(path.parts) for path in paths), default=0)):
        taken = Counter(names)
        names = [
            name if taken[name] == 1 else "_".join([*path.parent.parts[-depth:], path.stem]).strip("/")
            for name, path in zip(names, paths, strict=True)
        ]
    taken = Counter(names)
    # a.csv and a.mat in one folder differ by their ending only.
    return [name if taken[name] == 1 else path.name.replace(".", "_") for name, path in zip(names, paths, strict=True)]


def _period(time: Samples) -> float:
    """The step of `time` [s]: the mean of its steps but gaps where that is like the median, to the digits that a clock has."""
    if len(time) < 2:
        raise UserError(f"the file has {len(time)} samples; a recording needs at least 2")
    steps = np.diff(time)
    median = float(np.median(steps))
    mean = float(np.mean(steps[steps < GAP_FACTOR * median])) if median > 0 else median
    period = mean if abs(mean - median) < 1e-3 * abs(median) else median
    return float(f"{period:.6g}") if period > 0 else 1.0


def _on_equal_steps(file: Path, signals: Signals, import_map: ImportMap) -> Signals:
    """`signals` as they are, or by linear interpolation on the period that the map asks for; a kept gap stays one."""
    period = import_map.resample
    time = signals.time
    if len(time) < 2:
        raise UserError(f"{file} holds {len(time)} samples; a recording needs at least 2")
    if period is None:
        return signals
    steps = np.diff(time)
    falling = np.flatnonzero(steps <= 0)
    if falling.size:
        raise UserError(
            f"{file}: column time falls or stands still at row {int(falling[0]) + 2}; sort the rows before resampling"
        )
    median = float(np.median(steps))
    bridged = _BRIDGED * max(median, period)
    starts = np.flatnonzero(steps > bridged) + 1
    if starts.size and import_map.gaps == "refuse":
        at = int(starts[0])
        raise UserError(
            f"{file}: column time has a gap of {steps[at - 1]:g} s before row {at + 1} (time {time[at]:g} s); resampling "
            f"does not invent what was lost (steps up to {bridged:g} s are bridged): cut the file there, or say `gaps: keep` "
            "in the map"
        )
    if period > (1 + TOLERANCE) * median:
        logger.warning(
            "%s: resampled from %g to %g s without a filter; what is faster is aliased", file, median, period
        )
    if period * _FINEST < median:
        raise UserError(
            f"{file}: resample: {period:g} s is less than 1/{_FINEST} of the file's step, {median:g} s: give it in seconds"
        )
    segments = np.split(time, starts)
    longest = max(float(segment[-1] - segment[0]) for segment in segments)
    if period > longest:
        whole = "each segment between gaps, at most" if starts.size else "the file,"
        raise UserError(f"{file}: resample: {period:g} s is longer than {whole} {longest:g} s: give it in seconds")
    grid = _grid(file, segments, period)
    columns = {
        axis: {name: np.interp(grid, time, values) for name, values in named.items()}
        for axis, named in signals.columns.items()
    }
    return replace(signals, time=grid, columns=columns)


_BRIDGED = 4.0


def _grid(file: Path, segments: Sequence[Samples], period: float) -> Samples:
    """Times (n,) [s] within the segments, each a multiple of `period` after the first: a gap is missing from one grid."""
    zero = segments[0][0]
    counts = []
    for segment in segments:
        # A rounding of the time stamps does not lose the first or the last sample.
        first, last = (segment[0] - zero) / period * (1 - 1e-12), (segment[-1] - zero) / period * (1 + 1e-12)
        counts.append(np.arange(np.ceil(first), np.floor(last) + 1))
    missed = sum(not count.size for count in counts)
    if missed:
        logger.warning("%s: segments between gaps that are left out, being shorter than the period: %d", file, missed)
    return np.asarray(zero + np.concatenate(counts) * period)


def _integrate_positions(signals: Signals, starts: list[int]) -> list[str]:
    """Add positions that only velocities were recorded for (trapezoid); the names of what was added.

    Raises UserError across a gap, where how far the axis went is not known.
    """
    derived = []
    for axis, named in signals.columns.items():
        if "position" in named:
            continue
        if starts:
            raise UserError(
                f"{signals.files[0]}: {axis}.position cannot be integrated across a gap; cut the file at it"
            )
        travelled = cumulative_trapezoid(named["velocity"], signals.time, initial=0)
        named["position"] = signals.axes[axis].initial_position + travelled
        derived.append(f"{axis}.position")
    return derived


def _info(import_map: ImportMap, signals: Signals, period: float, derived: list[str]) -> RecordingInfo:
    payload: dict[str, Any] = {
        "machine": import_map.machine,
        "sample_period": period,
        "start_time": signals.start if import_map.start_time is None else import_map.start_time,
        "derived": derived,
        "axes": {axis: _axis_info(axis, entry) for axis, entry in signals.axes.items()},
    }
    extra = {"about": import_map.about, "repaired": signals.repaired}
    return RecordingInfo.model_validate(payload | {key: value for key, value in extra.items() if value})


def _axis_info(axis: str, entry: AxisMap) -> AxisInfo:
    known: dict[str, Any] = {
        "joint": entry.joint or axis,
        "actuator": entry.actuator,
        "rated_torque": entry.joint_rated_torque(),
        "torque_resolution": entry.torque_resolution,
        "torque_bandwidth_hz": entry.torque_bandwidth_hz,
        "torque_delay": entry.torque_delay,
        "position_resolution": entry.position_resolution,
        "position_relative": entry.position_relative or None,
        "gear_ratio": entry.gear_ratio,
        "drive": entry.drive,
    }
    return AxisInfo.model_validate({name: value for name, value in known.items() if value is not None})


def ordered(named: dict[str, Samples]) -> list[str]:
    """The names of an axis' columns in the contract's order."""
    return sorted(named, key=COLUMNS.index)
