"""The picture of one axis of one case: demand and truth, tracking error, torque, and the drive's state, over simulated time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from drivetwin.hil_tests.results.traces import AxisTrace, Mark, Traces
from drivetwin.recording.recording import Samples

TRUE, DEMAND, ERROR, LIMIT, FAULT, FAILED = "#00708f", "#e08a1e", "#1b2630", "#d1495b", "#b3362b", "#7a4fb5"
STATE_COLOURS = {
    "not_ready_to_switch_on": "#eef1f4",
    "switch_on_disabled": "#d9e0e6",
    "ready_to_switch_on": "#bcd3de",
    "switched_on": "#8fb9cb",
    "operation_enabled": "#2c7a4b",
    "quick_stop_active": "#e0a030",
    "fault_reaction_active": "#d1495b",
    "fault": "#b3362b",
}
Window = tuple[float, float]
Part = dict[str, Any]
"""Of a figure, as plotly.js has it."""

_GRID: Part = {"gridcolor": "#e6ebf0", "zerolinecolor": "#c3ccd4", "automargin": True}
_ROWS = ((0.67, 1.0), (0.4, 0.63), (0.13, 0.36), (0.0, 0.09))
"""From top to bottom: position, tracking error, torque, state."""


def axis_figure(
    traces: Traces, axis: str, tolerance: float | None, failed: Sequence[Mark], window: Window | None, points: int
) -> go.Figure:
    """Four rows over one time axis, opened at `window` [s], within which every sample is drawn, and some `points` elsewhere.

    `tolerance` is the largest tracking error allowed, drawn on both sides; `failed` are marked, as the faults are.
    """
    trace = traces.axes[axis]
    at = drawn(traces.time, trace, points, window)
    time = traces.time[at]
    whole = float(traces.time[0]), float(traces.time[-1])
    lines = [
        _line(time, trace.position[at], "true", TRUE, "y"),
        _line(time, trace.demand[at], "demand", DEMAND, "y", "dot"),
        _line(time, trace.tracking_error[at], "tracking error", ERROR, "y2"),
        _line(time, trace.torque[at], "motor torque" if trace.unit == "rad" else "motor force", TRUE, "y3"),
    ]
    marks = [*((mark, FAULT, "solid") for mark in traces.faults), *((mark, FAILED, "dash") for mark in failed)]
    titles = f"position [{trace.unit}]", f"error [{trace.unit}]", f"[{trace.torque_unit}]", "drive"
    ranges = {"xaxis": whole} if window is None else {"xaxis": window, **_zoomed(trace, traces.time, window)}
    layout = {
        **_frame(titles, ranges),
        "shapes": [*_limits(tolerance), *(_vertical(*mark) for mark in marks)],
        "annotations": list(_said(marks)),
        "updatemenus": [] if window is None else [_range_buttons(ranges, whole)],
    }
    return go.Figure({"data": [*lines, *_stays(trace, whole[1])], "layout": layout})


def drawn(time: Samples, trace: AxisTrace, points: int, window: Window | None) -> NDArray[np.intp]:
    """Indices (k,) of some `points` samples that keep every peak of tracking error and torque, and of all in `window`."""
    error = np.nan_to_num(trace.tracking_error)
    kept = [np.array([0, len(time) - 1])]
    for bucket in np.array_split(np.arange(len(time)), min(len(time), max(1, points // 4))):
        kept += [bucket[[pick(values[bucket])]] for values in (error, trace.torque) for pick in (np.argmin, np.argmax)]
    if window is not None:
        kept.append(np.arange(*np.searchsorted(time, window)))
    return np.unique(np.concatenate(kept))


def _line(time: Samples, values: Samples, name: str, colour: str, row: str, dash: str = "solid") -> Part:
    line = {"color": colour, "width": 1.3, "dash": dash}
    drawn_as = {"type": "scatter", "mode": "lines", "name": name, "line": line}
    return {**drawn_as, "x": time, "y": values.astype(np.float32), "yaxis": row}


def _stays(trace: AxisTrace, end: float) -> Iterator[Part]:
    """The band: one bar for each stay in a state, its colour named once in the legend."""
    named: set[str] = set()
    for now, then in pairwise([*trace.states, Mark(end, "")]):
        if then.time > now.time:
            words = now.text.replace("_", " ")
            yield {
                "type": "bar", "orientation": "h", "x": [then.time - now.time], "y": [0], "base": [now.time], "yaxis": "y4",
                "name": words, "legendgroup": words, "showlegend": words not in named,
                "marker": {"color": STATE_COLOURS[now.text], "line": {"width": 0}},
                "hovertemplate": f"{words}<br>{now.time:.3f} to {then.time:.3f} s<extra></extra>",
            }  # fmt: skip
            named.add(words)


def _limits(tolerance: float | None) -> list[Part]:
    line = {"color": LIMIT, "width": 1, "dash": "dash"}
    sides = () if tolerance is None else (tolerance, -tolerance)
    return [{"type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": "y2", "y0": y, "y1": y, "line": line} for y in sides]


def _vertical(mark: Mark, colour: str, dash: str) -> Part:
    line = {"color": colour, "width": 1.2, "dash": dash}
    return {"type": "line", "xref": "x", "x0": mark.time, "x1": mark.time, "yref": "paper", "y0": 0, "y1": 1, "line": line}


def _said(marks: Sequence[tuple[Mark, str, str]]) -> Iterator[Part]:
    """What happened, above its line; at one instant, one after the other."""
    for time in dict.fromkeys(mark.time for mark, _, _ in marks):
        here = {mark.text: colour for mark, colour, _ in marks if mark.time == time}
        yield {
            "x": time, "y": 1.0, "xref": "x", "yref": "paper", "xanchor": "left", "yanchor": "bottom", "showarrow": False,
            "text": escape(", ".join(here)), "font": {"color": next(iter(here.values())), "size": 11},
        }  # fmt: skip


def _zoomed(trace: AxisTrace, time: Samples, window: Window) -> dict[str, Window]:
    """The rows' ranges that hold what is within the window."""
    within = slice(*np.searchsorted(time, window).tolist())
    positions = np.concatenate([trace.position[within], trace.demand[within]])
    shown = {"yaxis": positions, "yaxis2": trace.tracking_error[within], "yaxis3": trace.torque[within]}
    finite = {row: values[np.isfinite(values)] for row, values in shown.items()}
    return {row: _around(values) for row, values in finite.items() if values.size}


def _around(values: Samples) -> Window:
    low, high = float(values.min()), float(values.max())
    margin = 0.1 * (high - low) or 1e-9
    return low - margin, high + margin


def _range_buttons(ranges: dict[str, Window], whole: Window) -> Part:
    """Between the ranges at the failure and all there is."""
    here = {f"{axis}.range": span for axis, span in ranges.items()}
    everything = {**{f"{axis}.autorange": True for axis in ranges if axis != "xaxis"}, "xaxis.range": whole}
    views = {"where it failed": here, "all": everything}
    buttons = [{"label": name, "method": "relayout", "args": [view]} for name, view in views.items()]
    return {"type": "buttons", "direction": "right", "buttons": buttons, "x": 1.0, "xanchor": "right", "y": 1.12}


def _frame(titles: Sequence[str], ranges: dict[str, Window]) -> Part:
    """The rows from top to bottom, on one time axis."""
    axes: dict[str, Part] = {
        row: {"title": {"text": title}, "domain": domain, "anchor": "x", **_GRID}
        for row, title, domain in zip(("yaxis", "yaxis2", "yaxis3", "yaxis4"), titles, _ROWS, strict=True)
    }
    axes["yaxis4"] |= {"showticklabels": False, "fixedrange": True}
    axes["xaxis"] = {"title": {"text": "simulated time [s]"}, "anchor": "y4", **_GRID}
    for axis, span in ranges.items():
        axes[axis]["range"] = span
    return {
        "template": {},
        "height": 560,
        "barmode": "overlay",
        "margin": {"l": 70, "r": 20, "t": 70, "b": 90},
        "font": {"family": "system-ui, sans-serif", "size": 12},
        "legend": {"orientation": "h", "y": -0.16, "yanchor": "top", "x": 0},
        **axes,
    }
