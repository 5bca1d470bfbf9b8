"""The report's pictures (plotly): torque over time and over velocity, the map of where, and what is left."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots
from scipy import stats

from diagnosis.report_view import GapMap, Spectra, Trace, drawn, mean_over
from diagnosis.result import Array

MEASURED, BEFORE, AFTER, NOISE = "#1b2630", "#d1495b", "#00708f", "#8a97a3"
_MOST_MARKERS = 2000
_BINS = 60


def time_figure(trace: Trace, window: tuple[float, float], unit: str) -> go.Figure:
    """Measured against simulated before and after, the gap below, opened at `window` [s]; buttons show all of it."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.6, 0.4], vertical_spacing=0.04)
    points = drawn(trace, window)
    time = trace.time[points]
    for name, torque, colour in (
        ("measured", trace.measured, MEASURED),
        ("simulated before", trace.before, BEFORE),
        ("simulated after", trace.after, AFTER),
    ):
        _line(figure, time, torque[points], name, colour, 1)
    for name, gap, colour in (("gap before", trace.gap_before, BEFORE), ("gap after", trace.gap_after, AFTER)):
        _line(figure, time, gap[points], name, colour, 2)
    for start in trace.starts[1:]:
        figure.add_vline(x=start, line={"color": "#999999", "width": 1, "dash": "dot"})
    whole = [float(trace.time[0]), float(trace.time[-1])]
    figure.update_xaxes(range=list(window))
    figure.update_xaxes(title="time, recordings one after the other [s]", row=2, col=1)
    figure.update_yaxes(title=f"torque [{unit}]" if unit != "N" else "force [N]", row=1, col=1)
    figure.update_yaxes(title=f"gap [{unit}]", row=2, col=1)
    figure.update_layout(updatemenus=[_range_buttons({"worst window": list(window), "all": whole})])
    return _styled(figure, 540).update_layout(margin={"t": 75})


def _line(figure: go.Figure, time: Array, values: Array, name: str, colour: str, row: int) -> None:
    line = {"color": colour, "width": 1.3}
    figure.add_scatter(
        x=_small(time), y=_small(values), mode="lines", name=name, line=line, showlegend=row == 1, row=row, col=1
    )


def _range_buttons(ranges: dict[str, list[float]]) -> dict[str, Any]:
    buttons = [
        {"label": name, "method": "relayout", "args": [{"xaxis.range": span, "xaxis2.range": span}]}
        for name, span in ranges.items()
    ]
    place = {"x": 1.0, "xanchor": "right", "y": 1.02, "yanchor": "bottom"}
    return {"type": "buttons", "direction": "right", "buttons": buttons, **place}


def velocity_figure(trace: Trace, unit: str, velocity_unit: str) -> go.Figure:
    """Left: torque over velocity, measured and simulated. Right: the gap over velocity before and after, with its mean."""
    figure = make_subplots(rows=1, cols=2, horizontal_spacing=0.09)
    used = np.flatnonzero(trace.used)
    few = used[:: max(1, len(used) // _MOST_MARKERS)]
    velocity = trace.velocity[few]
    for name, torque, colour in (
        ("measured", trace.measured, MEASURED),
        ("simulated before", trace.before, BEFORE),
        ("simulated after", trace.after, AFTER),
    ):
        _cloud(figure, velocity, torque[few], name, colour, 1)
    for name, gap, colour in (("gap before", trace.gap_before, BEFORE), ("gap after", trace.gap_after, AFTER)):
        _cloud(figure, velocity, gap[few], name, colour, 2)
        centre, mean = mean_over(trace.velocity[used], gap[used])
        line = {"color": colour, "width": 2.5}
        figure.add_scatter(x=centre, y=mean, mode="lines", name=f"{name}, mean", line=line, showlegend=False, row=1, col=2)
    figure.update_xaxes(title=f"velocity [{velocity_unit}]")
    figure.update_yaxes(title=f"torque [{unit}]" if unit != "N" else "force [N]", row=1, col=1)
    figure.update_yaxes(title=f"gap [{unit}]", row=1, col=2)
    return _styled(figure, 400)


def _cloud(figure: go.Figure, x: Array, y: Array, name: str, colour: str, column: int) -> None:
    marker = {"size": 3, "color": colour, "opacity": 0.4}
    figure.add_scatter(
        x=_small(x), y=_small(y), mode="markers", name=name, marker=marker, showlegend=column == 1, row=1, col=column
    )


def map_figure(found: GapMap, unit: str, position_unit: str, velocity_unit: str) -> go.Figure:
    """Rms of the gap over position and velocity, before and after, in one colour scale."""
    figure = make_subplots(rows=1, cols=2, subplot_titles=("before", "after"), horizontal_spacing=0.06, shared_yaxes=True)
    centre = 0.5 * (found.position[1:] + found.position[:-1])
    rows = np.arange(len(found.velocity) - 1)
    for column, cells in enumerate((found.before, found.after), start=1):
        hover = f"%{{x:.3g}} {position_unit}<br>%{{customdata}} {velocity_unit}<br>%{{z:.3g}} {unit}<extra></extra>"
        spans = [f"{low:.3g} to {high:.3g}" for low, high in zip(found.velocity[:-1], found.velocity[1:], strict=True)]
        custom = [[span] * len(centre) for span in spans]
        figure.add_heatmap(
            x=centre, y=rows, z=cells, coloraxis="coloraxis", customdata=custom, hovertemplate=hover, row=1, col=column
        )
    ticks = list(range(0, len(found.velocity), 3))
    figure.update_yaxes(
        title=f"velocity [{velocity_unit}], finer towards 0", tickvals=[tick - 0.5 for tick in ticks],
        ticktext=[f"{found.velocity[tick]:.2g}" for tick in ticks], row=1, col=1,
    )  # fmt: skip
    figure.update_xaxes(title=f"position [{position_unit}]")
    top = float(np.nanmax(found.before))
    scale = {"colorscale": "YlOrRd", "cmin": 0.0, "cmax": top, "colorbar": {"title": f"gap rms<br>[{unit}]", "thickness": 14}}
    figure.update_layout(coloraxis=scale)
    return _styled(figure, 400)


def left_figure(trace: Trace, spectra: Spectra, noise_rms: float, unit: str) -> go.Figure:
    """Left: power spectrum of the gap before and after against the noise. Right: histogram of what is left against it."""
    figure = make_subplots(rows=1, cols=2, horizontal_spacing=0.11)
    for name, density, colour, dash in (
        ("gap before", spectra.before, BEFORE, "solid"),
        ("gap after", spectra.after, AFTER, "solid"),
        ("noise", spectra.noise, NOISE, "dash"),
    ):
        line = {"color": colour, "width": 1.5, "dash": dash}
        figure.add_scatter(x=spectra.frequency, y=density, mode="lines", name=name, line=line, row=1, col=1)
    figure.update_xaxes(title="frequency [Hz]", type="log", tickvals=[0.5, 1, 2, 5, 10, 20, 50, 100, 200], row=1, col=1)
    squared = f"({unit})²/Hz" if "·" in unit else f"{unit}²/Hz"
    lowest = float(min(spectra.after.max(), spectra.noise.max()))
    decades = [np.log10(max(lowest, 1e-30)) - 2.5, np.log10(max(float(spectra.before.max()), 1e-30)) + 0.3]
    figure.update_yaxes(
        title=f"power density [{squared}]", type="log", dtick=1, range=decades, exponentformat="power", row=1, col=1
    )
    left = trace.gap_after[trace.used]
    density, edges = np.histogram(left, _BINS, density=True)
    centre = 0.5 * (edges[1:] + edges[:-1])
    figure.add_bar(x=centre, y=density, name="what is left", marker={"color": AFTER, "opacity": 0.5}, row=1, col=2)
    if noise_rms > 0.0:
        line = {"color": NOISE, "width": 2, "dash": "dash"}
        normal = stats.norm.pdf(centre, scale=noise_rms)
        figure.add_scatter(x=centre, y=normal, mode="lines", name="normal noise", line=line, row=1, col=2)
    figure.update_xaxes(title=f"gap after [{unit}]", row=1, col=2)
    figure.update_yaxes(title=f"share a {unit}", row=1, col=2)
    figure.update_layout(bargap=0.0)
    return _styled(figure, 380)


def _small(values: Array) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Half the bytes in the file, and more digits than a screen."""
    return values.astype(np.float32)


def _styled(figure: go.Figure, height: int) -> go.Figure:
    figure.update_layout(
        template="plotly_white",
        height=height,
        margin={"l": 70, "r": 20, "t": 40, "b": 55},
        font={"family": "system-ui, sans-serif", "size": 13},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
    )
    return figure
