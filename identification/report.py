"""report.html: one file that a browser shows without a network."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path

from drivetwin.foundation.html_page import figure_div, table, write_page
from drivetwin.identification.figures import residual_figure, torque_speed_figure
from drivetwin.identification.result import AxisIdentification, Identification, Test, Truth
from drivetwin.identification.truth import percent_error, true_law, true_value
from drivetwin.identification.wording import LABELS, number, summary_lines


def write_report(identification: Identification, path: Path, truth: Truth, title: str) -> None:
    """Write the report to `path`, whole or not at all."""
    body = [
        f"<header><h1>{html.escape(title)}</h1><p>Machine {html.escape(identification.machine)}</p></header>",
        _summary(identification, truth),
        *(_axis(result, truth.get(name)) for name, result in identification.axes.items()),
        _method(identification),
    ]
    write_page(path, title, body)


def _summary(identification: Identification, truth: Truth) -> str:
    lines = "".join(f"<li>{html.escape(line)}</li>" for line in summary_lines(identification, truth))
    return (
        f"<section><h2>Summary</h2><ul>{lines}</ul>"
        '<p class="note">Torque is modelled as inverse dynamics plus friction, linear in the parameters, and fitted by '
        "weighted least squares on samples in motion, with measured torque and regressors through the same zero-phase "
        "low-pass filter. Intervals are two-sided at "
        f"{identification.confidence:.0%} and allow for autocorrelated residuals.</p></section>"
    )


def _axis(result: AxisIdentification, truth: Mapping[str, float] | None) -> str:
    figures = (
        ("Friction over speed", torque_speed_figure(result, true_law(truth, result.best_offset))),
        ("Residual over time, in motion", residual_figure(result)),
    )
    plots = "".join(f"<h3>{title}</h3>{figure_div(figure)}" for title, figure in figures)
    return (
        f"<section><h2>Axis {html.escape(result.axis)}</h2>{_parameters(result, truth)}{_errors(result)}"
        f"{_verdicts(result)}{plots}</section>"
    )


def _parameters(result: AxisIdentification, truth: Mapping[str, float] | None) -> str:
    """The table identified vs true; the last three columns only where there is a truth."""
    known = truth or {}
    head = ["Parameter", "Identified", "90 % interval", "Unit"] + (["True", "Error", "In interval"] if known else [])
    rows = []
    for name, parameter in result.parameters.items():
        low, high = parameter.interval
        cells = [
            LABELS.get(name, name),
            number(parameter.value),
            f"{number(low)} &hellip; {number(high)}",
            html.escape(parameter.unit),
        ]
        rows.append(cells + (_truth_cells(parameter.value, low, high, true_value(known, name)) if known else []))
    for name, why in result.unidentifiable.items():
        rows.append([LABELS.get(name, name), f'<span class="note">not identifiable: {html.escape(why)}</span>'])
    return table(head, rows, numeric=(1, 2, 4, 5))


def _truth_cells(value: float, low: float, high: float, true: float | None) -> list[str]:
    if true is None:
        return ["", "", ""]
    error = percent_error(value, true)
    shown = f"{error:+.2f} %" if error is not None else "&ndash;"
    inside = low <= true <= high
    return [number(true), shown, '<span class="in">yes</span>' if inside else '<span class="out">no</span>']


def _errors(result: AxisIdentification) -> str:
    """Relative errors of both laws on both kinds of recording."""
    laws = [
        ("symmetric friction", result.relative_error, result.validation_relative_error),
        ("friction by direction", result.relative_error_directional, result.validation_relative_error_directional),
    ]
    validated = result.validation_relative_error is not None
    head = ["Relative error |measured - model| / |measured|", "fitted recordings"]
    rows = [
        [name, _percent(fitted), *([_percent(held)] if validated else [])] for name, fitted, held in laws if fitted is not None
    ]
    return table(head + (["validation recordings"] if validated else []), rows, numeric=(1, 2))


def _percent(value: float | None) -> str:
    return f"{value:.2%}" if value is not None else "&ndash;"


def _verdicts(result: AxisIdentification) -> str:
    items = [_verdict("Direction", result.direction)] if result.direction else []
    items.append(_verdict("Stribeck", result.stribeck))
    if result.minimum_velocity is not None:
        items.append(f"<li>Least friction at {number(result.minimum_velocity)} {result.units.velocity}.</li>")
    return f"<ul>{''.join(items)}</ul>"


def _verdict(name: str, test: Test) -> str:
    p_value = f"p = {test.p_value:.2g}" if test.p_value > 1e-12 else "p < 1e-12"
    figures = f"{p_value}, cross-validated gain {test.gain:.0%}"
    return f"<li><b>{name}:</b> {html.escape(test.note)} <span class=note>({figures})</span></li>"


def _method(identification: Identification) -> str:
    thresholds = ", ".join(
        f"{name} {number(axis.standstill_velocity)} {axis.units.velocity}" for name, axis in identification.axes.items()
    )
    lowered = (
        f"<li>Cut-off lowered to 0.4 of the sample rate in {len(identification.lowered_cutoffs)} recordings.</li>"
        if identification.lowered_cutoffs
        else ""
    )
    skipped = "".join(
        f"<li>Axis {html.escape(name)} has no result: {html.escape(why)}.</li>" for name, why in identification.skipped.items()
    )
    return (
        "<section><h2>How it was done</h2><ul>"
        f"<li>Filter: zero-phase 4th-order Butterworth at {identification.settings.cutoff_hz:g} Hz, forward and backward.</li>"
        f"{lowered}"
        f"<li>In motion means faster than: {html.escape(thresholds)}.</li>"
        f"<li>Left out on either side of a reversal: {identification.settings.reversal_margin * 1e3:g} ms.</li>{skipped}"
        "<li>Intervals: heteroskedasticity- and autocorrelation-consistent covariance (Newey and West 1987, bandwidth "
        "of Andrews 1991).</li>"
        "<li>Least squares on the inverse dynamic identification model: Gautier 1997; Janot, Vandanjon, Gautier 2014."
        "</li>"
        "</ul></section>"
    )
