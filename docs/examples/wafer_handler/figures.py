"""The pictures of the paper's figures, interactive (plotly)."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from drivetwin.controller.feedforward.stage import Stage
from drivetwin.identification.friction_law import FrictionLaw
from wafer_handler.dynamics_check import TorqueComparison
from wafer_handler.metrics import BAND, Tracking
from wafer_handler.results import AxisResult, StraightMove
from wafer_handler.scara.identification import FrictionCurve

COLOURS = {Stage.NONE: "#9db4c8", Stage.VELOCITY: "#00506b", Stage.TORQUE: "#d1495b"}
EQ14, LEARNED, TRUE, CLOUD = "#e09f1f", "#6a4c93", "rgba(17, 17, 17, 0.35)", "#9db4c8"
UNITS = {"lift": ("m", "N", "m/s"), "rotate": ("rad", "N·m", "rad/s"), "stretch": ("rad", "N·m", "rad/s")}
MICRO = {"lift": "um", "rotate": "urad", "stretch": "urad"}
_MARGIN = {"l": 70, "r": 20, "t": 30, "b": 50}
_DRAWN = 4000
"""Points drawn of a cloud; more cannot be distinguished, and slow the browser down."""


def torque_figure(compared: TorqueComparison) -> go.Figure:
    """Fig. 4: torque of the closed form beside the toolboxes' on a move of all axes, and their difference."""
    figure = make_subplots(rows=2, cols=3, shared_xaxes=True, row_heights=[0.6, 0.4], subplot_titles=tuple(UNITS),
                           horizontal_spacing=0.11, vertical_spacing=0.08)  # fmt: skip
    toolboxes = (("MuJoCo", compared.mujoco, "#d1495b", "dash"), ("Pinocchio", compared.pinocchio, "#edae49", "dot"))
    for number, (_, unit, _) in enumerate(UNITS.values()):
        ours, column = compared.closed_form[:, number], number + 1
        figure.add_scatter(x=compared.time, y=ours, name="closed form", row=1, col=column, showlegend=number == 0,
                           line={"color": COLOURS[Stage.VELOCITY], "width": 5})  # fmt: skip
        for name, torque, colour, dash in toolboxes:
            figure.add_scatter(x=compared.time, y=torque[:, number], name=name, row=1, col=column, showlegend=number == 0,
                               line={"color": colour, "dash": dash, "width": 2})  # fmt: skip
            figure.add_scatter(x=compared.time, y=torque[:, number] - ours, row=2, col=column, showlegend=False, name=name,
                               line={"color": colour, "width": 1})  # fmt: skip
        figure.update_yaxes(title_text=f"torque [{unit}]" if unit == "N·m" else f"force [{unit}]", row=1, col=column)
        figure.update_yaxes(title_text=f"difference [{unit}]", exponentformat="e", row=2, col=column)
        figure.update_xaxes(title_text="time [s]", row=2, col=column)
    return _finished(figure, 460)


def friction_figure(axis: str, curve: FrictionCurve, law: FrictionLaw, eq14: FrictionLaw, true: FrictionLaw) -> go.Figure:
    """Fig. 3: captured torque less the rigid arm's, and the laws."""
    _, torque, speed = UNITS[axis]
    figure = go.Figure()
    drawn = np.linspace(0, len(curve.velocity) - 1, min(_DRAWN, len(curve.velocity))).astype(int)
    figure.add_scatter(x=curve.velocity[drawn], y=curve.torque[drawn], mode="markers", name="captured - rigid arm",
                       marker={"size": 3, "color": CLOUD})  # fmt: skip
    top = float(np.abs(curve.velocity).max())
    grid = top * np.linspace(0.0005, 1.0, 800) ** 2
    for name, drawn_law, line in (
        ("true", true, {"color": TRUE, "width": 6}),
        ("eq. 14: Coulomb and viscous", eq14, {"color": EQ14, "width": 2, "dash": "dash"}),
        ("with Stribeck", law, {"color": COLOURS[Stage.TORQUE], "width": 2.5}),
    ):
        for sign in (-1.0, 1.0):
            figure.add_scatter(x=sign * grid, y=drawn_law.torque(sign * grid), name=name, line=line, showlegend=sign > 0)
    figure.update_xaxes(title_text=f"velocity [{speed}]")
    figure.update_yaxes(title_text=f"friction [{torque}]")
    return _finished(figure, 380)


def tracking_figure(axis: str, stages: dict[Stage, Tracking], eq14: Tracking) -> go.Figure:
    """Figs 5 to 7: tracking difference over time at each stage, three times as near each time; below, the band."""
    baseline = stages[Stage.VELOCITY]
    band = 1e6 * BAND * baseline.peak
    titles = ("all stages", "nearer: velocity alone, and with torque", "nearer still: +-5 % of the peak with velocity alone")
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.07, subplot_titles=titles)
    drawn = [(stage.value, found, COLOURS[stage]) for stage, found in stages.items()]
    for name, found, colour in (*drawn, ("velocity and torque by eq. 14", eq14, EQ14)):
        for row in (1, 2, 3):
            figure.add_scatter(x=1e3 * found.time, y=1e6 * found.error, name=name, row=row, col=1, showlegend=row == 1,
                               line={"color": colour, "width": 1.6})  # fmt: skip
    figure.add_hrect(y0=-band, y1=band, row=3, col=1, fillcolor="#edae49", opacity=0.18, line_width=0)
    figure.update_yaxes(title_text=f"demand - actual [{MICRO[axis]}]", row=2, col=1)
    figure.update_yaxes(title_text=f"[{MICRO[axis]}]", row=1, col=1)
    figure.update_yaxes(range=[-1.15e6 * baseline.peak, 1.15e6 * baseline.peak], row=2, col=1)
    figure.update_yaxes(title_text=f"[{MICRO[axis]}]", range=[-2.5 * band, 2.5 * band], row=3, col=1)
    for at, label in ((1e3 * baseline.cruise_start, "cruise"), (1e3 * baseline.cruise_end, "deceleration")):
        figure.add_vline(x=at, line={"color": "#888888", "dash": "dot", "width": 1})
        figure.add_annotation(x=at, y=1.0, yref="paper", text=label, showarrow=False, xanchor="left", font={"size": 11})
    figure.update_xaxes(title_text="time from the start of the move [ms]", row=3, col=1)
    return _finished(figure, 700)


def learning_figure(axis: str, result: AxisResult) -> go.Figure:
    """Peak tracking difference of each repetition, of both learnings."""
    figure = go.Figure()
    starts = (("after eq. 14", result.learned, EQ14), ("after the full torque", result.learned_further, COLOURS[Stage.TORQUE]))
    for name, runs, colour in starts:
        figure.add_scatter(x=list(range(len(runs))), y=[1e6 * run.peak for run in runs], name=name, mode="lines+markers",
                           line={"color": colour})  # fmt: skip
    figure.add_scatter(x=[0, len(result.learned) - 1], y=[1e6 * result.baseline] * 2, name="velocity alone", mode="lines",
                       line={"color": COLOURS[Stage.VELOCITY], "dash": "dash"})  # fmt: skip
    figure.update_yaxes(title_text=f"peak [{MICRO[axis]}]", type="log", dtick=1)
    figure.update_xaxes(title_text="repetition", dtick=1)
    return _finished(figure, 320)


def learned_figure(axis: str, result: AxisResult) -> go.Figure:
    """Tracking difference before the learning and after it."""
    figure = go.Figure()
    for name, run, colour in (
        ("torque by eq. 14, nothing learned", result.learned[0], EQ14),
        (f"after {len(result.learned) - 1} repetitions", result.learned[-1], LEARNED),
    ):
        figure.add_scatter(x=1e3 * run.time, y=1e6 * run.error, name=name, line={"color": colour, "width": 1.4})
    figure.update_yaxes(title_text=f"demand - actual [{MICRO[axis]}]")
    figure.update_xaxes(title_text="time from the start of the move [ms]")
    return _finished(figure, 320)


def straightness_figure(move: StraightMove) -> go.Figure:
    """How far the blade truly is from its line, at each stage."""
    figure = go.Figure()
    for stage, off in move.off.items():
        figure.add_scatter(x=1e3 * move.time, y=1e6 * off, name=stage.value,
                           line={"color": COLOURS[stage], "width": 1.6})  # fmt: skip
    figure.update_yaxes(title_text="true distance from the line [um]")
    figure.update_xaxes(title_text="time from the start of the move [ms]")
    return _finished(figure, 360)


def _finished(figure: go.Figure, height: int) -> go.Figure:
    figure.update_layout(template="simple_white", height=height, margin=_MARGIN, legend={"orientation": "h", "y": 1.12},
                         hovermode="x unified")  # fmt: skip
    return figure
