"""The section of the causes: what is behind the gap, how surely, how much of it, and what would settle what is open."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from drivetwin.diagnosis.report.result import UNKNOWN, Cause, CorrectedMass, Diagnosis, Estimate, Shrink
from drivetwin.diagnosis.report.wording import (
    LIKELY,
    UNDETERMINED,
    added_words,
    cause_name,
    chance,
    estimate_figures,
    goes_with_words,
    is_determined,
    listed,
    mass_words,
    masses_words,
    name_of,
    percent,
    residual_words,
    span_percent,
)
from drivetwin.foundation.page_table import DASH, bar, stacking_table


def causes_section(diagnosis: Diagnosis) -> str:
    """Causes in the report's order; those below 5 % in one line."""
    shown = [cause for cause in diagnosis.causes if cause.probability >= LIKELY]
    rest = [cause for cause in diagnosis.causes if cause.probability < LIKELY]
    head = ["Cause", "Axis", "Probability", "Share of gap", "Gap closed", "Parameters", "Cannot be distinguished from"]
    rows = stacking_table(head, [_row(cause, diagnosis) for cause in shown]) if shown else "<p>None.</p>"
    others = ", ".join(f"{cause_name(cause)} {chance(cause.probability)}" for cause in rest)
    less = f'<p class="note">Below {percent(LIKELY)}: {escape(others)}.</p>' if rest else ""
    added = added_words(diagnosis.selected)
    corrected = masses_words(diagnosis.masses)
    tables = f" {escape(residual_words(diagnosis))}" if diagnosis.residual else ""
    outcome = f"<b>patched.xml</b> with <b>effects.json</b> adds {escape(added)}." if added else "No effect is added."
    if corrected:
        outcome += f" <b>patched.xml</b> corrects {escape(corrected)}."
    return (
        f"<section><h2>Causes</h2>{rows}{less}{_distinguished(shown)}{_masses(diagnosis.masses)}<p>{outcome}{tables}</p>"
        '<p class="note">In the order of probability times share. The probability is that the effect, or one from which it '
        "cannot be distinguished, is there. The share is of the gaps of all axes, each relative to its torque. Gap closed "
        "is the part of the gap's energy on motion that was not fitted that goes when the effect is added to all others, on "
        "its own axis. "
        "Intervals in brackets are of 90 %.</p></section>"
    )


def _masses(masses: Sequence[CorrectedMass]) -> str:
    """Bodies whose mass is corrected: they close a gap as a cause does, and are none of the library's effects."""
    if not masses:
        return ""
    head = ["Corrected mass", "Most on axis", "Share of gap", "Gap closed", "In the model", "Found", "May be instead"]
    rows = [
        [
            f"<b>{escape(one.body)}</b>",
            escape(one.axis),
            _figure(one.share, percent(one.share)),
            _shrink(one.gap_closed) if one.gap_closed else DASH,
            *(escape(words) for words in mass_words(one)),
            escape(listed([name_of(effect) for effect in one.instead], "or")) or DASH,
        ]
        for one in masses
    ]
    note = '<p class="note">A wrong mass is a parameter of the model and no effect; its inertia changes in proportion.</p>'
    return f"{stacking_table(head, rows)}{note}"


def _row(cause: Cause, diagnosis: Diagnosis) -> list[str]:
    return [
        f"<b>{escape(name_of(cause.effect))}</b>",
        escape(cause.axis),
        _figure(cause.probability, chance(cause.probability)),
        _figure(cause.share, percent(cause.share)),
        _shrink(cause.gap_closed) if cause.gap_closed else DASH,
        _parameters(cause) if cause.effect != UNKNOWN else escape(goes_with_words(diagnosis.axes[cause.axis].unknown)),
        _alternatives(cause),
    ]


def _figure(share: float, words: str) -> str:
    return f'<span class="tight">{bar(share)}{words}</span>'


def _shrink(shrink: Shrink) -> str:
    """Of a gap that is no larger than the noise no interval says anything."""
    closed, of = percent(shrink.validation), shrink.of_explainable
    if of is None:
        return f'{closed}<span class="note"><br>without it the gap is no larger than the noise</span>'
    beyond = "; other motion may not get closer" if shrink.ci90[0] < 0.0 else ""
    return (
        f'{closed} <span class="note{"" if beyond else " tight"}">({span_percent(*shrink.ci90)}{beyond})</span>'
        f'<span class="note"><br>{percent(of)} of explainable</span>'
    )


def _parameters(cause: Cause) -> str:
    return "<br>".join(_parameter(name, estimate) for name, estimate in cause.parameters.items()) or DASH


def _parameter(name: str, estimate: Estimate) -> str:
    if not is_determined(name, estimate):
        return f"{escape(name_of(name))} {UNDETERMINED}"
    value, low, high, unit = estimate_figures(estimate)
    return (
        f'{escape(name_of(name))} <b class="tight">{escape(f"{value} {unit}".rstrip())}</b> '
        f'<span class="note tight">({low} to {high})</span>'
    )


def _alternatives(cause: Cause) -> str:
    return escape(listed(_names(cause), "or")) if cause.indistinguishable_from else DASH


def _names(cause: Cause) -> list[str]:
    return [name_of(effect) for effect in cause.indistinguishable_from]


def _distinguished(causes: Sequence[Cause]) -> str:
    """What to record, or to measure with, that distinguishes causes from what they may be as well: once each."""
    rows: dict[str, list[str]] = {}
    for cause in causes:
        told = [cause.tell_apart_by, cause.or_by_sensor]
        if any(told):
            names = sorted({name_of(cause.effect), *_names(cause)})
            words = f"{cause.axis}: {listed(names, 'or')}"
            rows.setdefault(words, [escape(words), *(escape(what) or DASH for what in told)])
    if not rows:
        return ""
    head = ["Axis and effects", "Record", "Or measure with"]
    return f"<h3>What would distinguish them</h3>{stacking_table(head, rows.values())}"
