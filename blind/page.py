"""Writes score.html: the promised figures, the confusion, how calibrated, how far the gap shrank, how long it took."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from drivetwin.blind.duration import Duration
from drivetwin.blind.score import NominalScore, Score, order_of_answers
from drivetwin.blind.table import (
    CALIBRATION_HEAD,
    EXTRA_HEAD,
    HEAD,
    MISS_HEAD,
    RATE_HEAD,
    calibration_rows,
    extra_row,
    miss_row,
    nothing_else,
    rate_row,
    strict_rows,
    strict_words,
    target_rows,
)
from drivetwin.foundation.html_page import figure_div, table, write_page

_ACCENT, _SOFT, _GOOD = "#00506b", "#5d6b78", "#2c7a4b"
_CLASS = {"reached": "in", "missed": "out"}


def write_score_page(path: Path, score: Score, durations: Sequence[Duration]) -> None:
    """Write the page, whole or not at all."""
    header = (
        f"<header><h1>Blind test of the diagnosis</h1><p>{score.cases} cases, seed {score.seed}; "
        f"key {score.commitment[:16]}…, code {score.code[:16]}…</p></header>"
    )
    sections = [header, _section("What was promised", _targets(score))]
    for of_nominal in score.nominal:
        sections += _nominal_sections(of_nominal)
    if durations:
        sections.append(_section("Time a case", figure_div(_durations(durations))))
    write_page(path, "Blind test of the diagnosis", sections)


def _section(title: str, *parts: str) -> str:
    return f"<section><h2>{title}</h2>{''.join(parts)}</section>"


def _escaped(rows: Iterable[Sequence[str]]) -> list[list[str]]:
    return [[html.escape(cell) for cell in row] for row in rows]


def _targets(score: Score) -> str:
    rows = [[*row[:-1], f'<span class="{_CLASS.get(row[-1], "note")}">{row[-1]}</span>'] for row in target_rows(score)]
    return table(HEAD, rows, (2, 3, 4, 5))


def _nominal_sections(score: NominalScore) -> list[str]:
    words = {"exact": "exact nominal parameters", "off": "nominal parameters off"}[score.nominal]
    brier = "" if score.brier is None else f'<p class="note">Brier score {score.brier:.3f}</p>'
    groups = (("Truth", score.by_effect), ("Machine", score.by_machine), ("Formulation", score.by_formulation))
    rates = [
        table((name, *RATE_HEAD[1:]), _escaped(rate_row(one.name, one.rate) for one in named), (1, 2, 3, 4))
        for name, named in groups
    ]
    return [
        _section(f"Which effect, {words}", figure_div(_confusion(score))),
        _section(
            f"How calibrated, {words}",
            figure_div(_calibration(score)),
            table(CALIBRATION_HEAD, calibration_rows(score.calibration), (1, 2, 3, 4, 5)),
            brier,
        ),
        _section(
            f"Strictly, {words}",
            table(("strictly", *RATE_HEAD[1:]), strict_rows(score), (1, 2, 3, 4)),
            f'<p class="note">{strict_words(score)} Every cause that was named, by its probability: is it there?</p>',
            table(CALIBRATION_HEAD, calibration_rows(score.strict.reliability), (1, 2, 3, 4, 5)),
            '<p class="note">As the contract counts it: is the cause there, or one that cannot be distinguished from it?</p>',
            table(CALIBRATION_HEAD, calibration_rows(score.or_alike.reliability), (1, 2, 3, 4, 5)),
        ),
        _section(f"How far the gap shrinks, {words}", figure_div(_shrinks(score))),
        _section(f"Right by what, {words}", *rates),
        _section(f"Not right, {words}", table(MISS_HEAD, _escaped(miss_row(miss) for miss in score.misses), (0, 6))),
        _section(
            f"Selected and not there, {words}",
            f'<p class="note">{nothing_else(score)}</p>',
            table(EXTRA_HEAD, _escaped(extra_row(extra) for extra in score.extras), (0,)),
        ),
    ]


def _confusion(score: NominalScore) -> go.Figure:
    """Truth downwards, answer to the right, number of cases; of cases with at most one effect."""
    truths, answers = order_of_answers(score.confusion)
    counts = np.zeros((len(truths), len(answers)), dtype=int)
    for cell in score.confusion:
        counts[truths.index(cell.truth), answers.index(cell.answer)] = cell.count
    words = [[str(count) if count else "" for count in row] for row in counts]
    heat = go.Heatmap(z=counts, x=answers, y=truths, text=words, texttemplate="%{text}", colorscale="Blues", showscale=False)
    figure = go.Figure(heat, layout=_layout("first answer", "truth", 160 + 22 * len(truths)))
    figure.update_yaxes(autorange="reversed")
    return figure


def _calibration(score: NominalScore) -> go.Figure:
    """Share of right answers over the mean called probability, with intervals; on the diagonal where promises hold."""
    figure = go.Figure(layout=_layout("called probability", "share that is right", 420))
    figure.add_scatter(x=[0, 1], y=[0, 1], mode="lines", line={"color": _SOFT, "dash": "dot"}, name="calibrated")
    bins = [one for one in score.calibration if one.right.of]
    shares = [one.right.hits / one.right.of for one in bins]
    bounds = [one.right.ci90 or (0.0, 1.0) for one in bins]
    above = [high - share for (_, high), share in zip(bounds, shares, strict=True)]
    below = [share - low for (low, _), share in zip(bounds, shares, strict=True)]
    bars = {"type": "data", "symmetric": False, "array": above, "arrayminus": below}
    labels = [f"{one.right.hits} of {one.right.of}" for one in bins]
    found = go.Scatter(x=[one.mean for one in bins], y=shares, error_y=bars, text=labels, mode="markers", name="found")
    figure.add_trace(found.update(marker={"color": _ACCENT, "size": 9}))
    figure.update_xaxes(range=[0, 1.02])
    figure.update_yaxes(range=[0, 1.02])
    return figure


def _shrinks(score: NominalScore) -> go.Figure:
    """How many axes had which share of their explainable energy closed; everything below 0 in the leftmost bar."""
    shown = np.clip(np.array(score.shrinks), -0.05, 1.05)
    bins = {"start": -0.05, "end": 1.1, "size": 0.05}
    figure = go.Figure(layout=_layout("closed share of the explainable energy", "axes", 360))
    figure.add_histogram(x=shown, xbins=bins, marker={"color": _GOOD})
    figure.update_xaxes(range=[-0.06, 1.06])
    return figure


def _durations(durations: Sequence[Duration]) -> go.Figure:
    """Seconds a case, of recording and of diagnosing, by machine."""
    figure = go.Figure(layout=_layout("machine", "s", 420))
    once = {duration.case: duration for duration in durations}.values()
    figure.add_box(x=[one.machine for one in once], y=[one.seconds.record for one in once], name="record")
    for nominal in dict.fromkeys(duration.nominal for duration in durations):
        those = [one for one in durations if one.nominal == nominal]
        figure.add_box(x=[one.machine for one in those], y=[one.seconds.diagnose for one in those], name=f"diagnose, {nominal}")
    figure.update_layout(boxmode="group")
    return figure


def _layout(x: str, y: str, height: int) -> go.Layout:
    margin = {"l": 60, "r": 20, "t": 20, "b": 60}
    return go.Layout(template="plotly_white", height=height, margin=margin, xaxis={"title": x}, yaxis={"title": y})
