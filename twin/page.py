"""replay.html: model and machine side by side. Figures first, then plots, opened where the difference is largest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from drivetwin.foundation import page_table
from drivetwin.foundation.figure_style import AFTER, BEFORE, MEASURED, range_buttons, small, styled
from drivetwin.foundation.html_page import write_page
from drivetwin.foundation.page_table import DASH, inputs_section, pictured, plain_table, stacking_table
from drivetwin.foundation.quantities import number, scale_of
from drivetwin.twin.comparison import MODEL, SIGNALS, WITH_EFFECTS, Array, AxisComparison, Comparison, worst

_TITLE = "Model and machine in closed loop"
_WINDOW = 2.0
"""Of time that a picture opens with [s]."""
_MOST_POINTS = 8000
"""Of a line over all of the time; around the window that is opened first every sample is drawn."""
_PICTURED = (("torque", "torque"), ("following_error", "following error"), ("velocity", "velocity"), ("position", "position"))
NAMES = {MODEL: "model", WITH_EFFECTS: "with effects"}
_COLOURS = {MODEL: BEFORE, WITH_EFFECTS: AFTER}


def write_replay_page(comparisons: Sequence[Comparison], picture: str, inputs: Mapping[str, str], path: Path) -> None:
    """Write the page to `path`, whole or not at all; `picture` is the machine as SVG, `inputs` are sha256 by path."""
    recordings = ", ".join(each.recording for each in comparisons)
    body = [
        f"{page_table.STYLE}<header><h1>{_TITLE}</h1><p>{escape(recordings)}</p></header>",
        _figures(comparisons),
        f"<section><h2>Machine</h2>{picture}</section>" if picture else "",
        *(_pictures(comparison, axis) for comparison, axis in worst(comparisons)),
        _method(comparisons),
        inputs_section(inputs),
    ]
    write_page(path, _TITLE, body)


def relative(axis: AxisComparison, run: str, signal: str) -> str:
    """How far a run is off, in per cent of the measured signal's norm; a dash where it was not measured."""
    if run not in axis.runs or signal not in axis.runs[run].apart:
        return DASH
    return f"{100.0 * axis.runs[run].apart[signal].relative:.3g} %"


def _figures(comparisons: Sequence[Comparison]) -> str:
    head = ["Recording", "Axis", "Run", *(name.replace("_", " ").capitalize() for name in SIGNALS)]
    rows = [
        [escape(each.recording), f"<b>{escape(name)}</b>", NAMES[run], *(relative(axis, run, signal) for signal in SIGNALS)]
        for each in comparisons
        for name, axis in each.moving.items()
        for run in axis.runs
    ]
    return (
        f"<section><h2>How far apart</h2>{stacking_table(head, rows, numeric=range(3, 8))}"
        '<p class="note">2-norm of measured less simulated over that of the measured signal. The share of the position depends '
        "on where its zero is; the same in units is in replay.json and below. "
        "Axes at rest in a recording are left out.</p></section>"
    )


def _pictures(comparison: Comparison, axis: AxisComparison) -> str:
    shown = [(signal, title) for signal, title in _PICTURED if signal in axis.measured]
    key = shown[0][0]
    window = _worst_window(comparison.time, axis.measured[key] - axis.runs[MODEL].signals[key], axis.used)
    rows = [_rms_row(title, axis.units[signal], [of.apart[signal].rms for of in axis.runs.values()]) for signal, title in shown]
    head = ["Rms apart", "Unit", *(NAMES[run] for run in axis.runs)]
    figures = "".join(
        pictured(f"{title.capitalize()} over time", _over_time(comparison.time, axis, signal, window))
        for signal, title in shown
    )
    return (
        f"<section><h2>Axis {escape(axis.axis)}, {escape(comparison.recording)}</h2>"
        f'<p class="note">Loops: {escape(axis.loops)}. Of the axis\'s recordings the one in which the model is furthest off, '
        f"opened where it is worst.</p>{plain_table(head, rows, numeric=range(2, 4))}{figures}</section>"
    )


def _rms_row(title: str, unit: str, rms: Sequence[float]) -> list[str]:
    """In one unit, that of the largest."""
    scale = scale_of(unit, max(rms))
    return [title, scale.unit, *(number(scale.factor * each) for each in rms)]


def _over_time(time: Array, axis: AxisComparison, signal: str, window: tuple[float, float]) -> go.Figure:
    """Measured and simulated above, measured less simulated below."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.6, 0.4], vertical_spacing=0.04)
    points, unit = _drawn(time, window), axis.units[signal]
    measured = axis.measured[signal]
    for name, values, colour, row in _lines(measured, axis, signal):
        figure.add_scatter(
            x=small(time[points]),
            y=small(values[points]),
            mode="lines",
            name=name,
            line={"color": colour, "width": 1.3},
            showlegend=row == 1,
            row=row,
            col=1,
        )
    figure.update_xaxes(range=list(window))
    figure.update_xaxes(title="time [s]", row=2, col=1)
    figure.update_yaxes(title=f"[{unit}]", row=1, col=1)
    figure.update_yaxes(title=f"apart [{unit}]", row=2, col=1)
    whole = [float(time[0]), float(time[-1])]
    figure.update_layout(updatemenus=[range_buttons({"worst window": list(window), "all": whole})])
    return styled(figure, 520).update_layout(margin={"t": 72})


def _lines(measured: Array, axis: AxisComparison, signal: str) -> Iterator[tuple[str, Array, str, int]]:
    yield "measured", measured, MEASURED, 1
    for run, of in axis.runs.items():
        yield NAMES[run], of.signals[signal], _COLOURS[run], 1
        yield NAMES[run], np.where(axis.used, measured - of.signals[signal], np.nan), _COLOURS[run], 2


def _worst_window(time: Array, apart: Array, used: NDArray[np.bool_]) -> tuple[float, float]:
    """The span of time [s] in which the difference has the most energy."""
    energy = np.concatenate([[0.0], np.cumsum(np.where(used, apart, 0.0) ** 2)])
    ends = np.searchsorted(time, time + _WINDOW, side="right")
    starts = np.flatnonzero(time <= max(float(time[0]), float(time[-1]) - _WINDOW))
    begin = float(time[starts[int(np.argmax(energy[ends[starts]] - energy[starts]))]])
    return begin, min(begin + _WINDOW, float(time[-1]))


def _drawn(time: Array, window: tuple[float, float]) -> NDArray[np.intp]:
    low, high = window
    every = np.arange(len(time)) % max(1, -(-len(time) // _MOST_POINTS)) == 0
    near = np.abs(time - 0.5 * (low + high)) <= high - low
    return np.flatnonzero(every | near)


def _method(comparisons: Sequence[Comparison]) -> str:
    cutoffs = ", ".join(sorted({f"{each.cutoff_hz:g}" for each in comparisons}))
    return (
        "<section><h2>Method</h2><p>The model is moved in MuJoCo from the recorded start by the recorded demand, through the "
        "loops that close on the simulated encoder. Nothing measured comes in after the first rows. Velocity and acceleration "
        "are central differences of the position, which goes through the same zero-phase filter on both sides, as torque does "
        f"(4th-order Butterworth, {cutoffs} Hz); position and following error are as they are. The filter's reach is left out "
        "at both ends.</p></section>"
    )
