"""What the plots show, as arrays: shared by the pictures in files and the interactive report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from drivetwin.identification.result import AxisIdentification, Identification, Trace, Truth
from drivetwin.identification.truth import true_value
from drivetwin.identification.wording import LABELS
from drivetwin.recording.recording import Samples

_MOST_POINTS = 6000
_MOST_STROKES = 400


@dataclass(frozen=True)
class ErrorPoint:
    """A parameter's deviation and the ends of its interval [%]: from the true value, else from the identified one."""

    axis: str
    label: str
    error: float
    low: float
    high: float


def error_points(identification: Identification, truth: Truth, names: Sequence[str]) -> list[ErrorPoint]:
    """Of these parameters on every axis, those with something to relate them to."""
    points = []
    for axis, result in identification.axes.items():
        for name in (each for each in names if each in result.parameters):
            parameter = result.parameters[name]
            against = true_value(truth[axis], name) if axis in truth else parameter.value
            if against:
                ends = [100.0 * (each - against) / abs(against) for each in (parameter.value, *parameter.interval)]
                points.append(ErrorPoint(axis, LABELS.get(name, name), *ends))
    return points


@dataclass(frozen=True)
class StrokePoints:
    """Steady strokes: (k,) each; `half_width` of the 90 % interval of the mean torque."""

    velocity: Samples
    torque: Samples
    half_width: Samples


def friction_points(result: AxisIdentification) -> tuple[Samples, Samples]:
    """Velocity and measured friction torque (law plus residual) of the samples in motion, thinned to a plot's size."""
    velocity, torque = [], []
    for trace in _fitted(result):
        moving = trace.samples.fitted
        speed = trace.samples.motion.velocity[moving]
        velocity.append(speed)
        torque.append(result.law.torque(speed) + trace.residual[moving])
    stacked = np.concatenate(velocity), np.concatenate(torque)
    step = max(1, len(stacked[0]) // _MOST_POINTS)
    return stacked[0][::step], stacked[1][::step]


def stroke_points(result: AxisIdentification) -> StrokePoints:
    """The strokes as points with intervals, the longest ones where there are very many."""
    strokes = sorted(result.strokes, key=lambda stroke: -stroke.duration)[:_MOST_STROKES]
    quantile = float(special.ndtri(0.95))
    return StrokePoints(
        np.array([stroke.velocity for stroke in strokes]),
        np.array([stroke.torque for stroke in strokes]),
        np.array([quantile * stroke.standard_error for stroke in strokes]),
    )


def speed_range(result: AxisIdentification) -> Samples:
    """Speeds to draw the law at, dense towards standstill; (802,)."""
    speeds = [np.abs(trace.samples.motion.velocity[trace.samples.moving]) for trace in _fitted(result)]
    top = max(float(speed.max(initial=0.0)) for speed in speeds)
    positive = np.concatenate([[1e-9 * top], np.geomspace(1e-4 * top, top, 400)])
    return np.concatenate([-positive[::-1], positive])


def residual_series(result: AxisIdentification) -> tuple[Samples, Samples, list[tuple[str, float]]]:
    """Time in motion [s], the residual there, and each recording with motion and where it starts; pauses are left out."""
    times, residuals, starts = [], [], []
    offset = 0.0
    for trace in _fitted(result):
        moving = trace.samples.moving
        if not moving.any():
            continue
        starts.append((trace.samples.motion.recording, offset))
        times.append(offset + trace.samples.motion.period * np.arange(int(moving.sum())))
        residuals.append(trace.residual[moving])
        offset = float(times[-1][-1]) + trace.samples.motion.period
    time, residual = np.concatenate(times), np.concatenate(residuals)
    step = max(1, len(time) // _MOST_POINTS)
    return time[::step], residual[::step], starts


def residual_range(residual: Samples) -> tuple[float, float]:
    """Of the axis: with room above for the names of the recordings."""
    low, high = float(residual.min()), float(residual.max())
    return low - 0.05 * (high - low), high + 0.5 * (high - low)


def motion_seconds(result: AxisIdentification) -> float:
    """Time in motion in the recordings that were fitted [s]."""
    return sum(trace.samples.motion.period * float(trace.samples.moving.sum()) for trace in _fitted(result))


def _fitted(result: AxisIdentification) -> list[Trace]:
    return [trace for trace in result.traces if not trace.validation]
