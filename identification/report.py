"""report.html: one file that a browser shows without a network."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path

from drivetwin.foundation.html_page import figure_div, table, write_page
from drivetwin.foundation.quantities import quantity
from drivetwin.identification.figures import difference_figure, error_figure, residual_figure, torque_speed_figure
from drivetwin.identification.result import AxisIdentification, Identification, Test, Truth
from drivetwin.identification.truth import true_law, true_value
from drivetwin.identification.wording import LABELS, headline, row_of, summary_lines

_STYLE = """<style>.headline { font-size: 18px; margin: 4px 0 12px; }</style>"""


def write_report(identification: Identification, path: Path, truth: Truth, title: str, picture: str = "") -> None:
    """Write the report to `path`, whole or not at all; `picture` is the machine as SVG."""
    body = [
        f"{_STYLE}<header><h1>{html.escape(title)}</h1><p>Machine {html.escape(identification.machine)}</p></header>",
        _summary(identification, truth, picture),
        *(_axis(result, truth.get(name)) for name, result in identification.axes.items()),
        _method(identification),
    ]
    write_page(path, title, body)


def _summary(identification: Identification, truth: Truth, picture: str) -> str:
    """The errors first, as a sentence and a figure; then the machine, and a line an axis."""
    sentence = headline(identification, truth)
    opening = f'<p class="headline">{html.escape(sentence)}</p>' if sentence else ""
    lines = "".join(f"<li>{html.escape(line)}</li>" for line in summary_lines(identification))
    shown = "Error of every parameter" if truth else "Interval of every parameter"
    return (
        f"<section><h2>Result</h2>{opening}<h3>{shown}</h3>{figure_div(error_figure(identification, truth))}{picture}"
        f"<ul>{lines}</ul>"
        '<p class="note">The model is inverse dynamics plus friction, linear in the parameters. The fit is weighted least '
        "squares on the samples in motion; measured torque and regressors pass the same zero-phase low-pass filter. Intervals "
        f"are two-sided at {100 * identification.confidence:.0f} % and allow for autocorrelated residuals.</p></section>"
    )


def _axis(result: AxisIdentification, truth: Mapping[str, float] | None) -> str:
    law = true_law(truth, result.best_offset)
    figures = [("Friction over speed", torque_speed_figure(result, law))]
    if law is not None:
        figures.append(("Fitted minus true friction", difference_figure(result, law)))
    figures.append(("Residual while the axis moves", residual_figure(result)))
    plots = "".join(f"<h3>{title}</h3>{figure_div(figure)}" for title, figure in figures)
    return (
        f"<section><h2>Axis {html.escape(result.axis)}</h2>{_parameters(result, truth)}{_errors(result)}"
        f"{_verdicts(result)}{plots}</section>"
    )


def _parameters(result: AxisIdentification, truth: Mapping[str, float] | None) -> str:
    """The table identified against true; three of its columns only where there is a truth."""
    known = truth or {}
    head = ["Parameter", "Identified", *(["True", "Error"] if known else []), "90 % interval", "Unit"]
    rows = []
    for name, parameter in result.parameters.items():
        row = row_of(name, parameter, true_value(known, name))
        cells = [row.label, row.value, *([row.true, row.error] if known else []), f"{row.low} &hellip; {row.high}", row.unit]
        rows.append([*cells, *([_holds(row.interval_holds)] if known else [])])
    for name, why in result.unidentifiable.items():
        rows.append([LABELS.get(name, name), f'<span class="note">not identifiable: {html.escape(why)}</span>'])
    if not known:
        return table(head, rows, numeric=(1, 2))
    return table([*head, "Interval holds the true value"], rows, numeric=(1, 2, 3, 4))


def _holds(words: str) -> str:
    return f'<span class="{"in" if words == "yes" else "note"}">{html.escape(words)}</span>'


def _errors(result: AxisIdentification) -> str:
    """Relative errors of both laws on both kinds of recording."""
    laws = [
        ("symmetric friction", result.relative_error, result.validation_relative_error),
        ("friction by direction", result.relative_error_directional, result.validation_relative_error_directional),
    ]
    validated = result.validation_relative_error is not None
    head = ["Relative error of the torque, |measured - model| / |measured|", "training recordings"]
    rows = [
        [name, _percent(fitted), *([_percent(held)] if validated else [])] for name, fitted, held in laws if fitted is not None
    ]
    return table(head + (["validation recordings"] if validated else []), rows, numeric=(1, 2))


def _percent(value: float | None) -> str:
    return f"{100.0 * value:.2f} %" if value is not None else "&ndash;"


def _verdicts(result: AxisIdentification) -> str:
    items = [_verdict("Direction", result.direction)] if result.direction else []
    items.append(_verdict("Stribeck", result.stribeck))
    if result.minimum_velocity is not None:
        items.append(f"<li>Minimum friction at {quantity(result.minimum_velocity, result.units.velocity)}.</li>")
    return f"<ul>{''.join(items)}</ul>"


def _verdict(name: str, test: Test) -> str:
    p_value = f"p = {test.p_value:.2g}" if test.p_value > 1e-12 else "p < 1e-12"
    figures = f"{p_value}, cross-validated gain {100.0 * test.gain:.0f} %"
    return f"<li><b>{name}:</b> {html.escape(test.note)} <span class=note>({figures})</span></li>"


def _method(identification: Identification) -> str:
    thresholds = ", ".join(
        f"{name} {quantity(axis.standstill_velocity, axis.units.velocity)}" for name, axis in identification.axes.items()
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
        "<section><h2>Method</h2><ul>"
        f"<li>Filter: zero-phase 4th-order Butterworth at {identification.settings.cutoff_hz:g} Hz, forward and backward.</li>"
        f"{lowered}"
        f"<li>In motion: faster than {html.escape(thresholds)}.</li>"
        f"<li>Left out on each side of a reversal: {identification.settings.reversal_margin * 1e3:g} ms.</li>{skipped}"
        "<li>Intervals: heteroskedasticity- and autocorrelation-consistent covariance (Newey and West 1987, bandwidth "
        "of Andrews 1991).</li>"
        "<li>Least squares on the inverse dynamic identification model: Gautier 1997; Janot, Vandanjon, Gautier 2014."
        "</li>"
        "</ul></section>"
    )
