"""The interactive versions of the plots (plotly)."""

from __future__ import annotations

import plotly.graph_objects as go

from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.result import AxisIdentification
from drivetwin.identification.view import friction_points, residual_series, speed_range, stroke_points
from drivetwin.recording.recording import Samples

CLOUD, FIT, DIRECTIONAL, TRUE, STROKE = "#9db4c8", "#d1495b", "#e09f1f", "rgba(17, 17, 17, 0.3)", "#00506b"
_MARGIN = {"l": 70, "r": 20, "t": 20, "b": 55}


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
    """Measured less model torque over time, recordings one after the other."""
    time, residual, starts = residual_series(result)
    figure = go.Figure()
    figure.add_scatter(x=time, y=residual, mode="lines", name="residual", line={"color": STROKE, "width": 1})
    for start in starts[1:]:
        figure.add_vline(x=start, line={"color": "#999999", "width": 1, "dash": "dot"})
    figure.update_layout(
        xaxis_title="time, recordings one after the other [s]",
        yaxis_title=f"measured - model [{result.units.torque}]",
        showlegend=False,
    )
    return _styled(figure, 300)


def _curve(figure: go.Figure, law: FrictionLaw, grid: Samples, name: str, line: dict[str, object]) -> None:
    figure.add_scatter(x=grid, y=law.torque(grid), mode="lines", name=name, line=line)


def _styled(figure: go.Figure, height: int) -> go.Figure:
    figure.update_layout(
        template="plotly_white",
        height=height,
        margin=_MARGIN,
        font={"family": "system-ui, sans-serif", "size": 13},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
    )
    return figure
