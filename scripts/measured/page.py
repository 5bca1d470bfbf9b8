"""Writes score.html: counts, the table with links to every report, the gap by machine, faults, what the reference is."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Sequence

import plotly.graph_objects as go

from drivetwin.foundation.html_page import figure_div, table, write_page
from measured.run import Place, Status
from measured.score import CaseScore, Score
from measured.table import HEAD, NUMERIC, notes, percent, row

TITLE = "Measured cases"
_BEFORE, _AFTER, _REFERENCE = "#b9c4cd", "#00506b", "#2c7a4b"
_CLASS = {"strict": "in", "accepted": "in", "yes": "in", "no": "out"}
_RIGHT, _BOTH, _RATIO, _MUST_NOT = (HEAD.index(name) for name in ("right", "both", "ratio", "must not"))


def write_score_page(place: Place, score: Score) -> None:
    """Write OUT/score.html, whole or not at all."""
    counts = "; ".join(f"{name} {hits} of {of}" for name, (hits, of) in score.counts.items())
    sections = [
        f"<header><h1>{TITLE}</h1><p>{html.escape(counts)}; code {score.code[:16]}…</p></header>",
        _section("What was answered", _answers(place, score)),
        _section("The gap on validation, machine by machine", figure_div(gap_figure(score))),
        _section("Faults", _faults(score)),
        _section("What the reference is", _references(score)),
        _section("Settings of the diagnosis, alike in all reports", _settings(score)),
    ]
    write_page(place.out / "score.html", TITLE, sections)


def gap_figure(score: Score) -> go.Figure:
    """Gap before, after and with the reference, in per cent of the measured torque; where nothing is answered, no `after`."""
    cases = sorted(score.cases, key=lambda case: case.machine)
    names = [[case.machine for case in cases], [case.name for case in cases]]
    margin = {"l": 60, "r": 20, "t": 20, "b": 150}
    figure = go.Figure(layout=go.Layout(template="plotly_white", height=520, margin=margin, barmode="group"))
    figure.add_bar(x=names, y=[_of_torque(case, case.reference.before) for case in cases], name="before", marker_color=_BEFORE)
    after = [_of_torque(case, case.reference.diagnosed) if case.closed is not None else None for case in cases]
    figure.add_bar(x=names, y=after, name="after", marker_color=_AFTER)
    best = [_of_torque(case, case.reference.after) for case in cases]
    figure.add_bar(x=names, y=best, name="reference", marker_color=_REFERENCE)
    figure.update_yaxes(title="gap [% of the measured torque, rms]")
    return figure


def _of_torque(case: CaseScore, rms: float) -> float:
    return 100.0 * rms / case.reference.torque if case.reference.torque > 0.0 else 0.0


def _answers(place: Place, score: Score) -> str:
    shown = table(HEAD, [_cells(place, case) for case in score.cases], NUMERIC)
    return shown + "".join(f'<p class="note">{html.escape(note)}</p>' for note in notes(score))


def _cells(place: Place, case: CaseScore) -> list[str]:
    cells = [html.escape(cell) for cell in row(case)]
    for at in (_RIGHT, _BOTH):
        cells[at] = _coloured(cells[at], _CLASS.get(cells[at], "note"))
    if case.reached is not None and case.ratio is not None:
        cells[_RATIO] = _coloured(cells[_RATIO], "in" if case.reached else "out")
    if case.must_not:
        cells[_MUST_NOT] = _coloured(cells[_MUST_NOT], "out")
    report = place.diagnosis(case.name) / "report.html"
    if case.status is Status.ANSWERED and report.is_file():
        cells[0] = f'<a href="{html.escape(report.relative_to(place.out).as_posix())}">{cells[0]}</a>'
    return cells


def _coloured(cell: str, name: str) -> str:
    return f'<span class="{name}">{cell}</span>'


def _faults(score: Score) -> str:
    told = [(case.name, fault) for case in score.cases for fault in case.faults]
    return table(("case", "fault"), _escaped(told), ()) if told else '<p class="note">none</p>'


def _references(score: Score) -> str:
    head = ("case", "fitted on the training recordings", "within each file", "cut-off [Hz]", "before", "left", "closed")
    rows = [
        (
            case.name,
            case.reference.fitted,
            case.reference.within_file or "-",
            f"{case.reference.band.cutoff_hz:g}",
            f"{case.reference.recorded:.4g}",
            f"{case.reference.after:.4g}",
            percent(case.reference.closed),
        )
        for case in score.cases
    ]
    return table(head, _escaped(rows), (3, 4, 5, 6))


def _settings(score: Score) -> str:
    rows = [(key, json.dumps(value)) for key, value in score.settings.items()]
    return table(("setting", "value"), _escaped(rows), ()) if rows else '<p class="note">no report tells them</p>'


def _section(title: str, body: str) -> str:
    return f"<section><h2>{html.escape(title)}</h2>{body}</section>"


def _escaped(rows: Iterable[Sequence[str]]) -> list[list[str]]:
    return [[html.escape(cell) for cell in each] for each in rows]
