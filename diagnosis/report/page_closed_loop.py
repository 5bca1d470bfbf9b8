"""The section on how far it shrinks in closed loop: motion and torque that come of the demand, without and with the effects."""

from __future__ import annotations

from html import escape

from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.diagnosis.report.wording import shrinks
from drivetwin.foundation.page_table import stacking_table
from drivetwin.twin.comparison import SIGNALS


def closed_loop_section(diagnosis: Diagnosis) -> str:
    """A row for each axis of each recording that was replayed; empty where none was."""
    if not diagnosis.closed_loop:
        return ""
    head = ["Recording", "Axis", *(name.replace("_", " ").capitalize() for name in SIGNALS)]
    rows = [
        [escape(each.recording), f"<b>{escape(name)}</b>", *(shrinks(axis, signal) for signal in SIGNALS)]
        for each in diagnosis.closed_loop
        for name, axis in each.moving.items()
    ]
    return (
        f"<section><h2>In closed loop</h2>{stacking_table(head, rows, numeric=range(2, 7))}"
        '<p class="note">The model moved from the recorded start by the recorded demand, through the drive\'s loops: 2-norm '
        "of measured less simulated over that of the measured signal, as the model stands and with the selected effects. The "
        "gap above is that of the torque on the measured motion. drivetwin replay shows both over time. "
        "Axes at rest in a recording are left out.</p></section>"
    )
