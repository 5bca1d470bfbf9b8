"""report.html of a commissioning: an axis a section, margins first."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drivetwin.foundation.html_page import figure_div, table, write_page
from drivetwin.identification.frequency.bode import SURE
from drivetwin.identification.frequency.figures import (
    closed_figure,
    mechanics_figure,
    open_figure,
    step_figure,
    torque_speed_figure,
)
from drivetwin.identification.frequency.result import AxisResponse
from drivetwin.identification.frequency.tuning import POSITION_GOAL, VELOCITY_GOAL, Goal
from drivetwin.identification.frequency.wording import rows


def write_report(found: Sequence[AxisResponse], told: dict[str, Any], path: Path) -> None:
    """Write the page to `path`, whole or not at all; `told` is what bode.json says, the drives' objects with it."""
    title = f"{told['machine']}: commissioning over the bus"
    head = f"<header><h1>{html.escape(title)}</h1><p>Frequency response, step response, torque over speed</p></header>"
    sections = [_axis(each, told["axes"][each.axis]["objects"]) for each in found]
    write_page(path, title, [head, *_failed(told["failed"]), *sections, _method()])


def _failed(reasons: dict[str, str]) -> list[str]:
    """One line an axis that tells nothing."""
    lines = "".join(f"<li>{html.escape(reason)}</li>" for reason in reasons.values())
    return [f"<section><h2>Measured in vain</h2><ul>{lines}</ul></section>"] if lines else []


def _axis(found: AxisResponse, objects: Sequence[dict[str, Any]]) -> str:
    figures = (
        ("Mechanics", mechanics_figure(found.bode, found.resonances, found.units)),
        ("Open loops", open_figure(found)),
        ("Closed loops", closed_figure(found)),
        ("Step of the position", step_figure(found)),
        ("Torque over speed", torque_speed_figure(found)),
    )
    told = [[html.escape(cell) for cell in (row.quantity, row.now, row.proposed)] for row in rows(found)]
    plots = "".join(f"<h3>{name}</h3>{figure_div(figure)}" for name, figure in figures)
    return (
        f"<section><h2>Axis {html.escape(found.axis)}</h2>{table(['', 'now', 'proposed'], told, (1, 2))}"
        f"{_objects(objects)}{plots}</section>"
    )


def _objects(objects: Sequence[dict[str, Any]]) -> str:
    if not objects:
        return '<p class="note">No gain that was tried keeps the margins: there is no proposal.</p>'
    cells = [
        [html.escape(str(each["quantity"]).replace("_", " ")), each["object"], f"{each['now']:.5g}", f"{each['proposed']:.5g}",
         html.escape(each["unit"])]
        for each in objects
    ]  # fmt: skip
    return f"<h3>Proposed gains as the drive takes them</h3>{table(['', 'object', 'now', 'proposed', 'unit'], cells, (2, 3))}"


def _method() -> str:
    return (
        "<section><h2>Method</h2><ul>"
        "<li>The axis travels to and fro at a tenth of its speed while a multisine torque (60B2h) is added: friction is then "
        "the same throughout a period, and the response is the small-signal response at this speed.</li>"
        "<li>Injected torque over torque at the motor is one more than the open loop, whatever the mechanics. The drive's "
        "position gain and speed filter split it into both loops.</li>"
        f"<li>A line is reliable if the standard deviation of the mechanics is at most {100.0 * SURE:g} %.</li>"
        "<li>The response is the mean along the travel. If the inertia changes along it, the coherence is lower.</li>"
        f"<li>Proposed: {_goal('velocity', VELOCITY_GOAL)}; {_goal('position', POSITION_GOAL)}. "
        "Nothing is written to a drive.</li>"
        "</ul></section>"
    )


def _goal(loop: str, goal: Goal) -> str:
    least = f"phase margin at least {goal.phase:g}°, gain margin {goal.gain:g} dB"
    return f"{loop} loop, {least}, sensitivity at most {goal.peak:g} dB"
