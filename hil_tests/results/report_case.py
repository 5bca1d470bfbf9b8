"""One case on the page: open with what failed and the evidence for it, or folded with its figures."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from drivetwin.foundation.html_page import figure_div, table
from drivetwin.hil_tests.folder import BUS_LOG, CONTROLLER_LOG
from drivetwin.hil_tests.results.bus_excerpt import ShownFrame, excerpt
from drivetwin.hil_tests.results.case_figure import Window, axis_figure
from drivetwin.hil_tests.results.pdo_words import PdoMapping
from drivetwin.hil_tests.results.report_bars import bar, share_words, used
from drivetwin.hil_tests.results.traces import Mark, Traces, read_traces
from drivetwin.hil_tests.results.wording import case_name, caveats, quantity, quantity_name
from drivetwin.hil_tests.verdict import CaseResult, Failure, Measured

_POINTS_REJECTED, _POINTS_ACCEPTED = 3000, 400
"""Drawn of an axis."""
_AROUND = 0.5
"""What a picture of a failure opens with on either side of it [s]."""
_STAMP = 6
"""Decimals of a log's time stamp [s]."""
_LAST_LINES = 25
"""Of the controller's own log."""
_TRACKING = "tracking error"


def anchor(case: CaseResult) -> str:
    """Where the page has it."""
    return escape(f"case-{case_name(case)}", quote=True)


def rejected_section(case: CaseResult, pdos: PdoMapping) -> str:
    """What failed, when, on which axis; the bus and the controller's log at that time; the pictures."""
    first = next((round(failure.time, _STAMP) for failure in case.failures if failure.time is not None), None)
    parts = [
        f'<h2>{escape(case_name(case))}: {escape(case.title)}</h2><p class="note">{escape(case.requirement)}</p>',
        _caveats(case),
        _failures(case.failures),
        _measured(case.measured),
        _bus(case, first, pdos),
        _last_words(case),
        _pictures(case, first),
    ]
    return f'<section class="rejected" id="{anchor(case)}">{"".join(parts)}</section>'


def _caveats(case: CaseResult) -> str:
    return "".join(f'<p class="note">{escape(words[0].upper() + words[1:])}.</p>' for words in caveats(case))


def _failures(failures: Sequence[Failure]) -> str:
    rows = [
        [
            escape(failure.expectation.replace("_", " ")),
            f'<span class="wrap">{escape(failure.message)}</span>',
            "&ndash;" if failure.time is None else f"{failure.time:.3f} s",
            escape(failure.axis or "") or "&ndash;",
            "&ndash;" if failure.measured is None else escape(quantity(failure.measured, failure.unit)),
            "&ndash;" if failure.limit is None else escape(quantity(failure.limit, failure.unit)),
        ]
        for failure in failures
    ]
    return table(["Expectation", "What failed", "When", "Axis", "Measured", "Limit"], rows, numeric=(2, 4, 5))


def _measured(measured: Sequence[Measured]) -> str:
    if not measured:
        return ""
    rows = [
        [
            escape(quantity_name(each.name, each.axis)),
            escape(quantity(each.value, each.unit)),
            "&ndash;" if each.limit is None else escape(quantity(each.limit, each.unit)),
            "&ndash;" if each.noise is None else escape(quantity(each.noise, each.unit)),
            "" if each.limit is None else bar(used(each)) + share_words(used(each)),
        ]
        for each in measured
    ]
    return table(["Figure", "Measured", "Limit", "Noise", "Of limit"], rows, numeric=(1, 2, 3))


def _bus(case: CaseResult, time: float | None, pdos: PdoMapping) -> str:
    log = None if case.folder is None else case.folder / BUS_LOG
    if log is None or not log.is_file():
        return ""
    frames = excerpt(log, time, pdos)
    if not frames:
        return "<p>No frame was on the bus.</p>"
    rows = [_frame(frame) for frame in frames]
    if time is not None:
        after = sum(frame.time <= time for frame in frames)
        rows.insert(after, [f"<code>{time:.6f}</code>", '<span class="out">here it failed</span>'])
    when = "at its end" if time is None else f"around {time:.3f} s"
    head = ["Time [s]", "COB-ID", "Node", "Service", "Data", "Says"]
    note = '<p class="note">PDOs are read as the bench orders them.</p>' if pdos else ""
    return f"<h3>The bus {when}</h3>{table(head, rows, numeric=(0, 2))}{note}"


def _frame(frame: ShownFrame) -> list[str]:
    return [
        f"<code>{frame.time:.6f}</code>",
        f"<code>{frame.identifier:03X}h</code>",
        "" if frame.node is None else str(frame.node),
        escape(frame.service),
        f"<code>{frame.data.hex(' ')}</code>",
        f'<span class="wrap small">{escape(frame.words)}</span>',
    ]


def _last_words(case: CaseResult) -> str:
    log = None if case.folder is None else case.folder / CONTROLLER_LOG
    if log is None or not log.is_file():
        return ""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()[-_LAST_LINES:]
    return f"<h3>The controller's last words</h3><pre>{escape(chr(10).join(lines))}</pre>" if lines else ""


def _pictures(case: CaseResult, time: float | None) -> str:
    """Of the axes that failed, opened where they did; of all where no failure is of one axis."""
    traces = None if case.folder is None else read_traces(case.folder)
    if traces is None:
        return ""
    failed = [failure.axis for failure in case.failures if failure.axis in traces.axes]
    axes = list(dict.fromkeys(failed)) or list(traces.axes)
    return "".join(_picture(case, traces, str(axis), _window(traces, time), _POINTS_REJECTED) for axis in axes)


def _window(traces: Traces, time: float | None) -> Window | None:
    if time is None:
        return None
    return max(float(traces.time[0]), time - _AROUND), min(float(traces.time[-1]), time + _AROUND)


def _picture(case: CaseResult, traces: Traces, axis: str, window: Window | None, points: int) -> str:
    limits = [each.limit for each in case.measured if each.name == _TRACKING and each.axis == axis]
    failed = [
        Mark(failure.time, failure.expectation.replace("_", " "))
        for failure in case.failures
        if failure.time is not None and failure.axis in (axis, None)
    ]
    figure = axis_figure(traces, axis, limits[0] if limits else None, failed, window, points)
    return f"<h3>{escape(axis)}</h3>{figure_div(figure)}"


def folded_case(case: CaseResult) -> str:
    """An accepted case, folded; its pictures are drawn when it is opened."""
    traces = None if case.folder is None else read_traces(case.folder)
    axes = traces.axes if traces is not None else {}
    pictures = "".join(_picture(case, traces, axis, None, _POINTS_ACCEPTED) for axis in axes if traces is not None)
    return (
        f'<details id="{anchor(case)}"><summary><span class="case">{escape(case_name(case))}</span> {escape(case.title)} '
        f'<span class="note">{case.simulated:.3g} s</span></summary>'
        f'<p class="note">{escape(case.requirement)}</p>{_caveats(case)}{_measured(case.measured)}'
        f"<template>{pictures}</template></details>"
    )
