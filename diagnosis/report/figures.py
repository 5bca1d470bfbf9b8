"""The report's pictures (plotly): torque over time and over velocity, the map of where, and what is left.

Each picture has one pair of axes, so that the page can put two beside each other, or one below the other on a phone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots
from scipy import stats

from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.report.view import GapMap, Spectra, Trace, drawn, mean_over
from drivetwin.foundation.figure_style import AFTER, BEFORE, MEASURED, range_buttons, small, styled

NOISE = "#8a97a3"
_MOST_MARKERS = 2000
_BINS = 60


def time_figure(trace: Trace, window: tuple[float, float], unit: str) -> go.Figure:
    """Measured against simulated before and after, the gap below, opened at `window` [s]; buttons show all of it."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.6, 0.4], vertical_spacing=0.04)
    points = drawn(trace, window)
    time = trace.time[points]
    for name, torque, colour in _torques(trace):
        _line(figure, time, torque[points], name, colour, 1)
    for name, gap, colour in _gaps(trace):
        _line(figure, time, gap[points], name, colour, 2)
    for start in trace.starts[1:]:
        figure.add_vline(x=start, line={"color": "#999999", "width": 1, "dash": "dot"})
    whole = [float(trace.time[0]), float(trace.time[-1])]
    figure.update_xaxes(range=list(window))
    title = "time, recordings one after the other [s]" if len(trace.starts) > 1 else "time [s]"
    figure.update_xaxes(title=title, row=2, col=1)
    figure.update_yaxes(title=_torque_title(unit), row=1, col=1)
    figure.update_yaxes(title=f"gap [{unit}]", row=2, col=1)
    figure.update_layout(updatemenus=[range_buttons({"worst window": list(window), "all": whole})])
    return styled(figure, 560).update_layout(margin={"t": 72})


def torque_figure(trace: Trace, unit: str, velocity_unit: str) -> go.Figure:
    """Torque over velocity, measured and simulated."""
    figure = go.Figure()
    few = _few(trace)
    for name, torque, colour in _torques(trace):
        _cloud(figure, trace.velocity[few], torque[few], name, colour)
    figure.update_xaxes(title=f"velocity [{velocity_unit}]")
    figure.update_yaxes(title=_torque_title(unit))
    return styled(figure, 400)


def gap_figure(trace: Trace, unit: str, velocity_unit: str) -> go.Figure:
    """The gap over velocity before and after, with its mean."""
    figure = go.Figure()
    few, used = _few(trace), trace.used
    for name, gap, colour in _gaps(trace):
        _cloud(figure, trace.velocity[few], gap[few], name, colour)
        centre, mean = mean_over(trace.velocity[used], gap[used])
        line = {"color": colour, "width": 2.5}
        figure.add_scatter(x=centre, y=mean, mode="lines", name=f"{name}, mean", line=line)
    figure.update_xaxes(title=f"velocity [{velocity_unit}]")
    figure.update_yaxes(title=f"gap [{unit}]")
    return styled(figure, 400)


def map_figures(found: GapMap, unit: str, position_unit: str, velocity_unit: str) -> tuple[go.Figure, go.Figure]:
    """Rms of the gap over position and velocity, before and after, on one scale of colours."""
    top = float(np.nanmax(found.before)) if np.isfinite(found.before).any() else 1.0
    both = ((found.before, "before"), (found.after, "after"))
    before, after = (_map_figure(found, cells, name, top, unit, position_unit, velocity_unit) for cells, name in both)
    return before, after


def _map_figure(
    found: GapMap, cells: Array, name: str, top: float, unit: str, position_unit: str, velocity_unit: str
) -> go.Figure:
    centre = 0.5 * (found.position[1:] + found.position[:-1])
    spans = [f"{low:.3g} to {high:.3g}" for low, high in zip(found.velocity[:-1], found.velocity[1:], strict=True)]
    figure = go.Figure(
        go.Heatmap(
            x=centre,
            y=np.arange(len(found.velocity) - 1),
            z=cells,
            zmin=0.0,
            zmax=top,
            colorscale="YlOrRd",
            colorbar={"title": {"text": f"[{unit}]"}, "thickness": 12},
            customdata=[[span] * len(centre) for span in spans],
            hovertemplate=f"%{{x:.3g}} {position_unit}<br>%{{customdata}} {velocity_unit}<br>%{{z:.3g}} {unit}<extra></extra>",
        )
    )
    ticks = list(range(0, len(found.velocity), 3))
    figure.update_yaxes(
        title=f"velocity [{velocity_unit}], finer towards 0",
        tickvals=[tick - 0.5 for tick in ticks],
        ticktext=[f"{found.velocity[tick]:.2g}" for tick in ticks],
    )
    figure.update_xaxes(title=f"position [{position_unit}]")
    return styled(figure, 400).update_layout(title={"text": f"gap {name}, rms", "font": {"size": 14}})


def spectrum_figure(spectra: Spectra, unit: str) -> go.Figure:
    """Power spectrum of the gap before and after against the noise."""
    figure = go.Figure()
    for name, density, colour, dash in (
        ("gap before", spectra.before, BEFORE, "solid"),
        ("gap after", spectra.after, AFTER, "solid"),
        ("noise", spectra.noise, NOISE, "dash"),
    ):
        line = {"color": colour, "width": 1.5, "dash": dash}
        figure.add_scatter(x=spectra.frequency, y=density, mode="lines", name=name, line=line)
    figure.update_xaxes(title="frequency [Hz]", type="log", tickvals=[0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000])
    squared = f"({unit})²/Hz" if "·" in unit else f"{unit}²/Hz"
    lowest = float(min(spectra.after.max(), spectra.noise.max()))
    decades = [np.log10(max(lowest, 1e-30)) - 2.5, np.log10(max(float(spectra.before.max()), 1e-30)) + 0.3]
    figure.update_yaxes(title=f"power density [{squared}]", type="log", dtick=1, range=decades, exponentformat="power")
    return styled(figure, 380)


def left_figure(trace: Trace, noise_rms: float, unit: str) -> go.Figure:
    """Histogram of what is left against the noise."""
    figure = go.Figure()
    density, edges = np.histogram(trace.gap_after[trace.used], _BINS, density=True)
    centre = 0.5 * (edges[1:] + edges[:-1])
    figure.add_bar(x=centre, y=density, name="gap after", marker={"color": AFTER, "opacity": 0.5})
    if noise_rms > 0.0:
        line = {"color": NOISE, "width": 2, "dash": "dash"}
        normal = stats.norm.pdf(centre, scale=noise_rms)
        figure.add_scatter(x=centre, y=normal, mode="lines", name="normal noise", line=line)
    figure.update_xaxes(title=f"gap after [{unit}]")
    figure.update_yaxes(title=f"probability density [1/({unit})]" if "·" in unit else f"probability density [1/{unit}]")
    return styled(figure, 380).update_layout(bargap=0.0)


def _torques(trace: Trace) -> tuple[tuple[str, Array, str], ...]:
    return (
        ("measured", trace.measured, MEASURED),
        ("simulated before", trace.before, BEFORE),
        ("simulated after", trace.after, AFTER),
    )


def _gaps(trace: Trace) -> tuple[tuple[str, Array, str], ...]:
    return ("gap before", trace.gap_before, BEFORE), ("gap after", trace.gap_after, AFTER)


def _torque_title(unit: str) -> str:
    return "force [N]" if unit == "N" else f"torque [{unit}]"


def _few(trace: Trace) -> np.ndarray[Any, np.dtype[np.intp]]:
    used = np.flatnonzero(trace.used)
    return used[:: max(1, len(used) // _MOST_MARKERS)]


def _line(figure: go.Figure, time: Array, values: Array, name: str, colour: str, row: int) -> None:
    line = {"color": colour, "width": 1.3}
    figure.add_scatter(
        x=small(time), y=small(values), mode="lines", name=name, line=line, showlegend=row == 1, row=row, col=1
    )


def _cloud(figure: go.Figure, x: Array, y: Array, name: str, colour: str) -> None:
    marker = {"size": 3, "color": colour, "opacity": 0.4}
    figure.add_scatter(x=small(x), y=small(y), mode="markers", name=name, marker=marker)
