"""report.html: one file that a browser shows without a network."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import groupby
from pathlib import Path

import plotly.graph_objects as go

from diagnosis.remains import regimes_after, spells_after
from diagnosis.report_figures import left_figure, map_figure, time_figure, velocity_figure
from diagnosis.report_view import gap_map, spectra_of, trace_of, worst_window
from diagnosis.result import AxisGap, Cause, Diagnosis, Regime, Shrink, Verdict
from diagnosis.wording import (
    cause_name,
    closed,
    closed_of_explainable,
    estimate_words,
    name_of,
    number,
    of_torque,
    others_words,
    percent,
    spells_words,
    time_words,
    verdict_sentence,
)
from drivetwin.html_page import figure_div, table, write_page
from drivetwin.motion.filtering import effective_cutoff

_WINDOW = 4.0
"""Of time that the report opens with [s]."""
_NAMED_FROM = 0.01
_SPELLS_SHOWN = 5
_STYLE = """<style>
.verdict { font-size: 18px; margin: 4px 0 12px; } .verdict.good { color: var(--good); } .verdict.bad { color: var(--bad); }
.bar { display: inline-block; width: 120px; height: 10px; background: #e8edf1; border-radius: 5px; margin-right: 8px; }
.bar i { display: block; height: 100%; background: var(--accent); border-radius: 5px; min-width: 2px; }
.wrap { white-space: normal; display: inline-block; max-width: 210px; } td { vertical-align: top; }
.causes td { font-size: 14px; } .causes .bar { width: 70px; } code { font-size: 12px; color: var(--soft); }
</style>"""


def write_report_page(diagnosis: Diagnosis, inputs: Mapping[str, str], path: Path) -> None:
    """Write the report to `path`, whole or not at all; `inputs` are sha256 by path."""
    recordings = ", ".join(prediction.recording for prediction in diagnosis.predictions)
    body = [
        f"{_STYLE}<header><h1>Simulation against machine</h1><p>Axes {escape(', '.join(diagnosis.axes))}; gap measured on "
        f"{escape(recordings)}</p></header>",
        _verdict(diagnosis),
        _causes(diagnosis),
        *(_axis(name, diagnosis) for name in diagnosis.axes),
        _method(diagnosis),
        _inputs(inputs),
    ]
    write_page(path, "Simulation against machine", body)


def _verdict(diagnosis: Diagnosis) -> str:
    kind = {Verdict.EXPLAINED: "good", Verdict.NO_GAP: "good", Verdict.UNEXPLAINED: "bad"}.get(diagnosis.verdict, "")
    levels = ["Torque", "Gap", "Noise", "Gap after"]
    head = ["Axis", "Unit", *levels, "Closed", "Of explainable", "At standstill", "Beyond noise?"]
    rows = [_overview(name, diagnosis) for name in diagnosis.axes]
    data = (
        "No validation recordings were given: blocks of the recordings were held back from the fit, and the figures are of "
        "these blocks."
        if diagnosis.held_back
        else "The figures are of the validation recordings, which were not fitted."
    )
    if diagnosis.fitted:
        data += f" Those of {escape(', '.join(diagnosis.fitted))} in motion are of the fitted recordings."
    notes = "".join(f"<li>{escape(note)}</li>" for note in diagnosis.notes)
    return (
        f'<section><h2>Verdict</h2><p class="verdict {kind}">{escape(verdict_sentence(diagnosis))}</p>'
        f'{table(head, rows, numeric=range(2, 9))}<p class="note">Levels are rms over samples in motion, in brackets as a '
        f"share of the torque. {data}</p>"
        f"{f'<ul>{notes}</ul>' if notes else ''}</section>"
    )


def _overview(name: str, diagnosis: Diagnosis) -> list[str]:
    gap, after = diagnosis.told(name)
    explained = closed_of_explainable(gap, after)
    levels = [number(gap.torque_rms), of_torque(gap.gap_rms, gap), number(gap.noise_rms), of_torque(after, gap)]
    shares = [percent(closed(gap, after)), percent(explained) if explained is not None else "&ndash;"]
    if not gap.significant:
        shares = ["&ndash;", "&ndash;"]
    answer = f"{_answer(name, diagnosis)}{_p_value(gap)}"
    return [escape(name), escape(diagnosis.units[name]), *levels, *shares, number(gap.standstill_rms), answer]


def _answer(name: str, diagnosis: Diagnosis) -> str:
    if not diagnosis.axes[name].significant:
        return '<span class="in">no</span>'
    return f'<span class="out">{"yes (fitted)" if name in diagnosis.fitted else "yes"}</span>'


def _p_value(gap: AxisGap) -> str:
    shown = f"p = {gap.p_value:.2g}" if gap.p_value > 1e-12 else "p &lt; 1e-12"
    return f' <span class="note">{shown}</span>'


def _causes(diagnosis: Diagnosis) -> str:
    steps = [_step(step, list(causes)) for step, causes in groupby(diagnosis.causes, key=lambda cause: cause.step)]
    added = "; ".join(f"{name_of(placed.effect.name)} on {placed.axis}" for placed in diagnosis.selected)
    outcome = f"<b>patched.xml</b> with <b>effects.json</b> adds {escape(added)}." if added else "No effect is added."
    return (
        f'<section class="causes"><h2>What causes it</h2>{"".join(steps)}<p>{outcome}</p>'
        '<p class="note">The answers of a step share one probability, given the other effects selected. Parameters and gap '
        "closed with 90 % intervals; gap closed is the share of the gap's energy on the validation data that the effect takes "
        "away.</p></section>"
    )


def _step(step: int, causes: Sequence[Cause]) -> str:
    named = [cause for rank, cause in enumerate(causes) if rank == 0 or cause.probability >= _NAMED_FROM]
    rest = causes[len(named) :]
    head = ["Cause", "Probability", "Parameters", "Gap closed", "Could also be"]
    more = ""
    if rest:
        total = sum(cause.probability for cause in rest)
        answers = others_words(len(rest)).capitalize()
        more = f'<p class="note">{answers}: {100.0 * total:.1f} %.</p>'
    rows = table(head, [_cause(cause) for cause in named], numeric=())
    return f"<h3>Step {step}</h3>{rows}{more}{_told_apart(causes[0])}"


def _cause(cause: Cause) -> list[str]:
    parameters = "<br>".join(escape(estimate_words(name, estimate)) for name, estimate in cause.parameters.items())
    shrink = cause.gap_closed
    return [
        f'<b class="wrap">{escape(cause_name(cause))}</b>',
        f"{_bar(cause.probability)}{percent(cause.probability)}",
        parameters,
        _shrink(shrink) if shrink else "&ndash;",
        f'<span class="wrap">{_alternatives(cause)}</span>',
    ]


def _shrink(shrink: Shrink) -> str:
    low, high = shrink.ci90
    share = shrink.of_explainable
    explainable = f"{percent(share)} of explainable" if share is not None else "no larger than the noise"
    return f"{percent(shrink.validation)} ({percent(low)} to {percent(high)})<br><span class=note>{explainable}</span>"


def _alternatives(cause: Cause) -> str:
    return escape(", ".join(name_of(effect) for effect in cause.indistinguishable_from))


def _told_apart(cause: Cause) -> str:
    """What would tell the first answer of a step from those that it could also be."""
    if not cause.tell_apart_by:
        return ""
    return f'<p class="note">{escape(cause_name(cause))} is told apart by {escape(cause.tell_apart_by)}.</p>'


def _bar(share: float) -> str:
    return f'<span class="bar"><i style="width:{100.0 * share:.1f}%"></i></span>'


def _axis(name: str, diagnosis: Diagnosis) -> str:
    gap, unit = diagnosis.axes[name], diagnosis.units[name]
    position_unit, velocity_unit = ("m", "m/s") if unit == "N" else ("rad", "rad/s")
    cutoff_hz = max(effective_cutoff(each.period, diagnosis.cutoff_hz) for each in diagnosis.shown_on(name))
    trace = trace_of(diagnosis.shown_on(name), name, cutoff_hz)
    if not trace.used.any():
        return f"<section><h2>Axis {escape(name)}</h2><p>No sample in motion on the validation data.</p></section>"
    spectra = spectra_of(diagnosis.shown_on(name), name, gap.noise_rms, cutoff_hz)
    over_time = time_figure(trace, worst_window(trace, _WINDOW), unit)
    if gap.significant:
        found = gap_map(trace)
        where = _where(gap, velocity_unit) + _pictured("Over velocity", velocity_figure(trace, unit, velocity_unit))
        where += _pictured("The map of where", map_figure(found, unit, position_unit, velocity_unit))
    else:
        where = '<p class="note">The gap is no more than noise: there is nothing to place.</p>'
    return (
        f"<section><h2>Axis {escape(name)}</h2>"
        f"{_pictured('Measured and simulated over time, opened where the gap is worst', over_time)}{where}"
        f"{_pictured('What is left', left_figure(trace, spectra, gap.noise_rms, unit))}{_remains(name, diagnosis)}</section>"
    )


def _remains(axis: str, diagnosis: Diagnosis) -> str:
    """When most of the gap after stands, and in which regime."""
    gap, unit = diagnosis.axes[axis], diagnosis.units[axis]
    if not gap.significant:
        return ""
    left = regimes_after(diagnosis, axis)
    if not left:
        return "<p>Nothing is left above noise.</p>"
    most = max(left, key=lambda regime: regime.share)
    sentence = f"Of what is left above noise {percent(most.share)} stands in the regime {most.regime.replace('_', ' ')}."
    spells = spells_after(diagnosis, axis)
    if spells:
        sentence += f" {percent(sum(spell.share for spell in spells))} of its energy is in {spells_words(len(spells))}."
    rows = [
        [escape(spell.recording), time_words(spell), f"{number(spell.rms)} {unit}", percent(spell.share)]
        for spell in spells[:_SPELLS_SHOWN]
    ]
    largest = table(["Largest in recording", "Time", "Level, rms", "Share of energy"], rows, numeric=(2, 3)) if rows else ""
    return f"<p>{sentence}</p>{largest}"


def _cutoffs(diagnosis: Diagnosis) -> list[float]:
    """What each recording was filtered at [Hz]."""
    return [effective_cutoff(prediction.period, diagnosis.cutoff_hz) for prediction in diagnosis.predictions]


def _pictured(title: str, figure: go.Figure) -> str:
    return f"<h3>{title}</h3>{figure_div(figure)}"


def _where(gap: AxisGap, velocity_unit: str) -> str:
    """Bars of the regimes, and the patterns."""
    regimes = [
        [escape(each.regime.replace("_", " ")), f"{_bar(each.share)}{percent(each.share)}", _bounds(each, velocity_unit)]
        for each in gap.where
    ]
    patterns = [
        [escape(each.over.replace("_", " ")), f"{_bar(each.share)}{percent(each.share)}", escape(each.detail)]
        for each in gap.patterns
    ]
    varies = table(["Varies over", "Share of energy", "How"], patterns, numeric=()) if patterns else ""
    return (
        "<h3>Where in the motion, and how it varies</h3>"
        f"{table(['Regime', 'Share of energy', 'Bounds'], regimes, numeric=())}{varies}"
    )


_MAGNITUDES = {"time": "time to a reversal", "displacement": "way from a stop or reversal", "acceleration": "|acceleration|"}


def _bounds(regime: Regime, velocity_unit: str) -> str:
    units = {
        "time": "s",
        "displacement": velocity_unit.removesuffix("/s"),
        "acceleration": f"{velocity_unit}²",
        "velocity": velocity_unit,
        "speed": velocity_unit,
    }
    return ", ".join(
        f"{_MAGNITUDES.get(name, name)} {number(low)} to {number(high)} {units[name]}"
        for name, (low, high) in regime.interval.items()
    )


def _method(diagnosis: Diagnosis) -> str:
    speeds = ", ".join(
        f"{axis} {number(speed)} {'m/s' if diagnosis.units[axis] == 'N' else 'rad/s'}"
        for axis, speed in diagnosis.standstill_velocity.items()
    )
    noise = "".join(
        f"<li>Noise of {escape(axis)}, {number(gap.noise_rms)} {escape(diagnosis.units[axis])} rms: "
        f"{escape(gap.noise_found_by)}.</li>"
        for axis, gap in diagnosis.axes.items()
    )
    lowest = min(_cutoffs(diagnosis))
    lowered = f", lowered to 0.4 of the sample rate where that is less ({lowest:.3g} Hz)"
    lowered = lowered if lowest < diagnosis.cutoff_hz else ""
    tests = "".join(f"<li>Is there a gap? {escape(test)}.</li>" for test in _once(gap.test for gap in diagnosis.axes.values()))
    return (
        "<section><h2>How it was done</h2><ul>"
        f"<li>Measured and predicted torque go through the same zero-phase 4th-order Butterworth filter at "
        f"{diagnosis.cutoff_hz:g} Hz{lowered}, forward and backward.</li>"
        f"<li>Only samples in motion count, faster than {escape(speeds)}: at standstill stiction holds an arbitrary torque, "
        "and the level there is given apart.</li>"
        f"{noise}{tests}"
        "<li>Gap closed is 1 - (gap after / gap before)² in rms; of what can be explained, with the noise's square taken off "
        "both.</li>"
        "<li>Regimes: every sample in motion counts in the first that fits, in the order of the table; shares are of the gap's "
        "energy above noise.</li>"
        "<li>Varies over: what goes with a quantity beyond the axis's own direction, speed and acceleration, cross-validated; "
        "each has its own share, and they do not add up.</li>"
        f"<li>Seed {diagnosis.seed}.</li></ul></section>"
    )


def _once(lines: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(lines))


def _inputs(inputs: Mapping[str, str]) -> str:
    rows = [[escape(path), f"<code>{digest}</code>"] for path, digest in inputs.items()]
    return f"<section><h2>Inputs</h2>{table(['File', 'sha256'], rows, numeric=())}</section>"
