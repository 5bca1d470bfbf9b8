"""report.html: one file that a browser shows without a network. The verdict first; a section a file (page_*.py)."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path

import mujoco

from drivetwin.diagnosis.report import page_shares
from drivetwin.diagnosis.report.page_axis import axis_section
from drivetwin.diagnosis.report.page_causes import causes_section
from drivetwin.diagnosis.report.page_closed_loop import closed_loop_section
from drivetwin.diagnosis.report.page_method import method_section
from drivetwin.diagnosis.report.result import Diagnosis, Verdict
from drivetwin.diagnosis.report.wording import closed, listed, of_torque, p_words, percent, verdict_sentence
from drivetwin.foundation import page_table
from drivetwin.foundation.html_page import write_page
from drivetwin.foundation.machine_picture import machine_picture
from drivetwin.foundation.page_table import DASH, inputs_section, stacking_table
from drivetwin.foundation.quantities import number, scale_of

_TITLE = "Simulation against machine"


def write_report_page(diagnosis: Diagnosis, inputs: Mapping[str, str], path: Path) -> None:
    """Write the report to `path`, whole or not at all; `inputs` are sha256 by path."""
    recordings = listed([prediction.recording for prediction in diagnosis.predictions])
    axes = f"{'Axes' if len(diagnosis.axes) > 1 else 'Axis'} {listed(list(diagnosis.axes))}"
    body = [
        f"{page_table.STYLE}{page_shares.STYLE}<header><h1>{_TITLE}</h1><p>{escape(axes)}; gap measured on "
        f"{escape(recordings)}</p></header>",
        _verdict(diagnosis),
        page_shares.shares_section(diagnosis),
        closed_loop_section(diagnosis),
        causes_section(diagnosis),
        _machine(diagnosis),
        *(axis_section(name, diagnosis) for name in diagnosis.axes),
        method_section(diagnosis),
        inputs_section(inputs),
    ]
    write_page(path, _TITLE, [section for section in body if section])


def _machine(diagnosis: Diagnosis) -> str:
    """A picture of the model that was compared, with its recorded joints marked."""
    picture = machine_picture(mujoco.MjModel.from_xml_string(diagnosis.model_xml), diagnosis.axes)
    return f"<section><h2>Machine</h2>{picture}</section>" if picture else ""


def _verdict(diagnosis: Diagnosis) -> str:
    kind = {Verdict.EXPLAINED: "good", Verdict.NO_GAP: "good", Verdict.UNEXPLAINED: "bad"}.get(diagnosis.verdict, "")
    head = ["Axis", "Beyond noise?", "Unit", "Torque", "Gap", "Noise", "Gap after", "Closed", "Unknown"]
    rows = [_overview(name, diagnosis) for name in diagnosis.axes]
    data = (
        "No validation recordings were given: blocks of the recordings were held back from the fit, and the figures refer to "
        "these blocks."
        if diagnosis.held_back
        else "The figures refer to the validation recordings, which were not fitted."
    )
    notes = "".join(f"<li>{escape(note)}</li>" for note in diagnosis.notes)
    return (
        f'<section><h2>Verdict</h2><p class="verdict {kind}">{escape(verdict_sentence(diagnosis))}</p>'
        f'{stacking_table(head, rows, numeric=range(3, 9))}<p class="note">Levels are rms over samples in motion, in brackets '
        "as a share of the torque. Closed and unknown are shares of the gap's energy (its mean square). "
        f"{data}</p>{f'<ul>{notes}</ul>' if notes else ''}</section>"
    )


def _overview(name: str, diagnosis: Diagnosis) -> list[str]:
    gap, after = diagnosis.axes[name], diagnosis.after_rms[name]
    scale = scale_of(diagnosis.units[name], gap.gap_rms)
    torque, noise = (number(scale.factor * each) for each in (gap.torque_rms, gap.noise_rms))
    levels = [torque, of_torque(gap.gap_rms, gap, scale), noise, of_torque(after, gap, scale)]
    shares = [percent(closed(gap, after)), percent(gap.unknown.share)] if gap.significant else [DASH, DASH]
    answer = '<b class="out">yes</b>' if gap.significant else '<span class="in">no</span>'
    test = f'{answer} <span class="note">{escape(p_words(gap.p_value))}</span>'
    return [f"<b>{escape(name)}</b>", test, escape(scale.unit), *levels, *shares]
