"""The pictures in files: torque against speed with the fitted curve, residual against time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from drivetwin.foundation.quantities import scale_of
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.result import AxisIdentification, Identification, Truth
from drivetwin.identification.view import (
    error_points,
    friction_points,
    motion_seconds,
    residual_range,
    residual_series,
    speed_range,
    stroke_points,
)
from drivetwin.identification.wording import SHAPE, SIZES

STYLE: dict[str, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
}
AXES = ("#00506b", "#d1495b", "#e09f1f", "#5b8c5a", "#7a5195", "#8a6f4e", "#3f88c5")
_CLOUD, _FIT, _DIRECTIONAL, _TRUE, _STROKE = "#9db4c8", "#d1495b", "#edae49", "#111111", "#00506b"


def draw_axis(result: AxisIdentification, directory: Path, true_law: FrictionLaw | None) -> list[Path]:
    """Write AXIS_torque_speed.png and AXIS_residual.png into `directory`; their paths."""
    paths = [directory / f"{result.axis}_torque_speed.png", directory / f"{result.axis}_residual.png"]
    with mpl.rc_context(rc=STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 4.2), dpi=150)
        _torque_speed(figure.subplots(), result, true_law)
        _save(figure, paths[0])
        figure = Figure(figsize=(7.2, 3.2), dpi=150)
        _residual(figure.subplots(), result)
        _save(figure, paths[1])
    return paths


def draw_overview(identification: Identification, directory: Path, true_laws: Mapping[str, FrictionLaw | None]) -> Path:
    """Write friction.png: torque against speed of every axis, side by side; its path."""
    path = directory / "friction.png"
    with mpl.rc_context(rc=STYLE):  # type: ignore[arg-type]
        count = len(identification.axes)
        figure = Figure(figsize=(1.2 + 4.0 * count, 3.6), dpi=150)
        panels = figure.subplots(1, count, squeeze=False)[0]
        for panel, (name, result) in zip(panels, identification.axes.items(), strict=True):
            _torque_speed(panel, result, true_laws.get(name))
        _save(figure, path)
    return path


def draw_errors(identification: Identification, directory: Path, truth: Truth) -> Path:
    """Write errors.png: the error of every parameter with its interval, or the interval alone; its path."""
    path = directory / "errors.png"
    titled = {"inertia and friction": SIZES, "shape of the Stribeck curve": SHAPE}
    panels = {title: error_points(identification, truth, names) for title, names in titled.items()}
    rows = max(len(points) for points in panels.values())
    colours = {axis: AXES[at % len(AXES)] for at, axis in enumerate(identification.axes)}
    against = "true" if truth else "identified"
    with mpl.rc_context(rc=STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(9.6, 1.2 + 0.24 * rows), dpi=150)
        for axes, (title, points) in zip(figure.subplots(1, 2), panels.items(), strict=True):
            for at, point in enumerate(points):
                sides = [[point.error - point.low], [point.high - point.error]]
                axes.errorbar([point.error], [at], xerr=sides, fmt="o", color=colours[point.axis], markersize=5, capsize=2)
            axes.axvline(0.0, color="#333333", linewidth=0.8)
            axes.set_yticks(range(len(points)), [f"{point.axis}: {point.label}" for point in points])
            axes.invert_yaxis()
            axes.set(xlabel=f"deviation from the {against} value [%]", title=title)
        _save(figure, path)
    return path


def _save(figure: Figure, path: Path) -> None:
    """Write it with a constrained layout, made once: a figure that has the layout itself is drawn a time more for it."""
    ConstrainedLayoutEngine().execute(figure)
    figure.savefig(path)


def _torque_speed(axes: Axes, result: AxisIdentification, true_law: FrictionLaw | None) -> None:
    units = result.units
    speed, torque = friction_points(result)
    axes.plot(speed, torque, ".", color=_CLOUD, markersize=1.5, rasterized=True)
    axes.plot([], [], ".", color=_CLOUD, markersize=6, label="measured, minus model torque")
    points = stroke_points(result)
    if len(points.velocity):
        axes.errorbar(
            points.velocity, points.torque, yerr=points.half_width, fmt="o", color=_STROKE, markersize=4, capsize=2,
            label="steady strokes, 90 % interval",
        )  # fmt: skip
    grid = speed_range(result)
    for branch in (grid[grid < 0], grid[grid > 0]):
        if true_law:
            axes.plot(branch, true_law.torque(branch), color=_TRUE, linewidth=3.0, alpha=0.35)
        if result.directional_law and result.direction and result.direction.real:
            axes.plot(branch, result.directional_law.torque(branch), "--", color=_DIRECTIONAL, linewidth=1.6)
        axes.plot(branch, result.law.torque(branch), color=_FIT, linewidth=1.6)
    axes.plot([], [], color=_FIT, label="fitted")
    if result.directional_law and result.direction and result.direction.real:
        axes.plot([], [], "--", color=_DIRECTIONAL, label="fitted, by direction")
    if true_law:
        axes.plot([], [], color=_TRUE, linewidth=3.0, alpha=0.35, label="true, with the fitted offset")
    low, high = np.percentile(torque, [0.5, 99.5])
    room = 0.15 * (high - low)
    axes.set(
        xlabel=f"velocity [{units.velocity}]", ylabel=f"friction {units.word} [{units.torque}]",
        title=f"{result.axis}: friction over speed", ylim=(low - room, high + room),
    )  # fmt: skip
    axes.legend(fontsize=8, loc="best")


def _residual(axes: Axes, result: AxisIdentification) -> None:
    units = result.units
    time, residual, starts = residual_series(result)
    scale = scale_of(units.torque, float(np.abs(residual).max(initial=0.0)))
    axes.plot(time, scale.factor * residual, color=_STROKE, linewidth=0.6)
    for at, (recording, start) in enumerate(starts):
        if at:
            axes.axvline(start, color="#888888", linewidth=0.6, linestyle=":")
        axes.annotate(
            recording, (start, 1.0), xycoords=("data", "axes fraction"), xytext=(2, -2), textcoords="offset points",
            rotation=90, ha="left", va="top", fontsize=7, color="#555555",
            bbox={"facecolor": "white", "alpha": 0.75, "linewidth": 0, "pad": 1},
        )  # fmt: skip
    axes.set(
        xlabel="time in motion, recordings one after the other [s]", ylabel=f"measured - model [{scale.unit}]",
        title=f"{result.axis}: residual while it moves ({motion_seconds(result):.1f} s)",
        ylim=residual_range(scale.factor * residual),
    )  # fmt: skip
