"""The interactive versions of the plots (plotly)."""

from __future__ import annotations

from html import escape

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from drivetwin.foundation.quantities import scale_of
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.result import AxisIdentification, Identification, Truth
from drivetwin.identification.view import (
    error_points,
    friction_points,
    residual_range,
    residual_series,
    speed_range,
    stroke_points,
)
from drivetwin.identification.wording import SHAPE, SIZES
from drivetwin.recording.recording import Samples

CLOUD, FIT, DIRECTIONAL, TRUE, STROKE = "#9db4c8", "#d1495b", "#e09f1f", "rgba(17, 17, 17, 0.3)", "#00506b"
_MARGIN = {"l": 70, "r": 20, "t": 20, "b": 55}


AXES = ("#00506b", "#d1495b", "#e09f1f", "#5b8c5a", "#7a5195", "#8a6f4e", "#3f88c5")
"""Colours of the axes, in turn."""
_ROW = 26


def error_figure(identification: Identification, truth: Truth) -> go.Figure:
    """Error of every parameter with its interval; without a truth, the intervals alone. The curve's shape has its own scale."""
    panels = [points for names in (SIZES, SHAPE) if (points := error_points(identification, truth, names))]
    titles = ("inertia and friction", "shape of the Stribeck curve")[: len(panels)]
    figure = make_subplots(1, max(1, len(panels)), subplot_titles=titles, horizontal_spacing=0.24)
    colours = {axis: AXES[at % len(AXES)] for at, axis in enumerate(identification.axes)}
    against = "true" if truth else "identified"
    for column, points in enumerate(panels, start=1):
        for axis in dict.fromkeys(point.axis for point in points):
            chosen = [point for point in points if point.axis == axis]
            bars = {
                "type": "data",
                "symmetric": False,
                "array": [point.high - point.error for point in chosen],
                "arrayminus": [point.error - point.low for point in chosen],
                "thickness": 2,
            }
            names = [f"{axis}: {point.label}" for point in chosen]
            figure.add_scatter(
                x=[point.error for point in chosen], y=names, error_x=bars, mode="markers", name=axis, row=1, col=column,
                marker={"size": 9, "color": colours[axis]}, showlegend=False,
            )  # fmt: skip
        figure.add_vline(x=0.0, line={"color": "#333333", "width": 1}, row=1, col=column)
        figure.update_xaxes(title_text=f"deviation from the {against} value [%]", row=1, col=column)
    figure.update_yaxes(autorange="reversed", automargin=True)
    height = 150 + _ROW * max((len(points) for points in panels), default=1)
    return _styled(figure, height, top=64)


def difference_figure(result: AxisIdentification, true_law: FrictionLaw) -> go.Figure:
    """Fitted minus true friction over speed, and what the steady strokes measured minus the true friction."""
    grid, points = speed_range(result), stroke_points(result)
    fitted = result.law.torque(grid) - true_law.torque(grid)
    measured = points.torque - true_law.torque(points.velocity)
    scale = scale_of(result.units.torque, max(np.abs(fitted).max(), np.abs(measured).max(initial=0.0)))
    figure = go.Figure()
    figure.add_hline(y=0.0, line={"color": "#333333", "width": 1})
    figure.add_scatter(x=grid, y=scale.factor * fitted, mode="lines", name="fitted - true", line={"color": FIT, "width": 2.5})
    figure.add_scatter(
        x=points.velocity, y=scale.factor * measured, mode="markers", name="steady strokes - true, 90 % interval",
        error_y={"type": "data", "array": scale.factor * points.half_width, "thickness": 1},
        marker={"size": 7, "color": STROKE},
    )  # fmt: skip
    figure.update_layout(xaxis_title=f"velocity [{result.units.velocity}]", yaxis_title=f"difference [{scale.unit}]")
    return _styled(figure, 300)


def torque_speed_figure(result: AxisIdentification, true_law: FrictionLaw | None) -> go.Figure:
    """Friction over speed: measured cloud, steady strokes with intervals, fitted curves, and the true one."""
    units = result.units
    speed, torque = friction_points(result)
    figure = go.Figure()
    figure.add_scatter(x=speed, y=torque, mode="markers", name="measured", marker={"size": 3, "color": CLOUD})
    grid = speed_range(result)
    if true_law:
        _curve(figure, true_law, grid, "true, with the fitted offset", {"color": TRUE, "width": 6})
    if result.directional_law and result.direction and result.direction.real:
        _curve(figure, result.directional_law, grid, "fitted, by direction", {"color": DIRECTIONAL, "dash": "dash"})
    _curve(figure, result.law, grid, "fitted", {"color": FIT, "width": 2.5})
    points = stroke_points(result)
    if len(points.velocity):
        figure.add_scatter(
            x=points.velocity,
            y=points.torque,
            error_y={"type": "data", "array": points.half_width, "thickness": 1},
            mode="markers",
            name="steady strokes, 90 % interval",
            marker={"size": 7, "color": STROKE},
        )
    figure.update_layout(xaxis_title=f"velocity [{units.velocity}]", yaxis_title=f"friction {units.word} [{units.torque}]")
    return _styled(figure, 430)


def residual_figure(result: AxisIdentification) -> go.Figure:
    """Measured minus model torque over the time in motion, recordings one after the other, each named where it begins."""
    time, residual, starts = residual_series(result)
    scale = scale_of(result.units.torque, float(np.abs(residual).max(initial=0.0)))
    figure = go.Figure()
    figure.add_scatter(x=time, y=scale.factor * residual, mode="lines", name="residual", line={"color": STROKE, "width": 1})
    for at, (recording, start) in enumerate(starts):
        if at:
            figure.add_vline(x=start, line={"color": "#999999", "width": 1, "dash": "dot"})
        figure.add_annotation(
            x=start, y=1.0, yref="paper", text=escape(recording), textangle=-90, xanchor="left", yanchor="top", showarrow=False,
            font={"size": 11, "color": "#555555"}, bgcolor="rgba(255,255,255,0.75)",
        )  # fmt: skip
    figure.update_layout(
        xaxis_title="time in motion, recordings one after the other [s]",
        yaxis_title=f"measured - model [{scale.unit}]",
        yaxis_range=residual_range(scale.factor * residual),
        showlegend=False,
    )
    return _styled(figure, 300)


def _curve(figure: go.Figure, law: FrictionLaw, grid: Samples, name: str, line: dict[str, object]) -> None:
    figure.add_scatter(x=grid, y=law.torque(grid), mode="lines", name=name, line=line)


def _styled(figure: go.Figure, height: int, top: int = 20) -> go.Figure:
    figure.update_layout(
        template="plotly_white",
        height=height,
        margin=_MARGIN | {"t": top},
        font={"family": "system-ui, sans-serif", "size": 13},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
    )
    return figure
