"""The section of one axis: its gap in pictures, where it is, what is left of it, and what could not be tested."""

from __future__ import annotations

import re
from html import escape

from drivetwin.diagnosis.report.figures import gap_figure, left_figure, map_figures, spectrum_figure, time_figure, torque_figure
from drivetwin.diagnosis.report.page_frequency import frequency_part
from drivetwin.diagnosis.report.remains import intervals_after
from drivetwin.diagnosis.report.result import AxisGap, Diagnosis, Regime
from drivetwin.diagnosis.report.view import Trace, gap_map, spectra_of, trace_of, worst_window
from drivetwin.diagnosis.report.wording import (
    goes_with_words,
    interval_words,
    level,
    listed,
    name_of,
    percent,
    time_words,
    untested,
)
from drivetwin.foundation.page_table import DASH, bar, pictured, plain_table, stacking_table
from drivetwin.foundation.quantities import span
from drivetwin.motion.filtering import effective_cutoff

_WINDOW = 4.0
"""Of time that the report opens with [s]."""
_INTERVALS_SHOWN = 5


def axis_section(name: str, diagnosis: Diagnosis) -> str:
    """Everything about one axis."""
    gap = diagnosis.axes[name]
    cutoff_hz = max(effective_cutoff(each.period, gap.cutoff_hz) for each in diagnosis.predictions)
    trace = trace_of(diagnosis.predictions, name, cutoff_hz)
    if not trace.used.any():
        seen = "<p>No sample in motion on the validation data: there is nothing to compare.</p>"
    elif gap.significant:
        seen = _significant(name, diagnosis, trace, cutoff_hz)
    else:
        nothing = '<p class="note">The gap is no more than noise: there is nothing to place.</p>'
        seen = nothing + _over_time(trace, diagnosis.units[name])
    return f"<section><h2>Axis {escape(name)}</h2>{seen}{frequency_part(name, diagnosis)}{_not_testable(gap)}</section>"


def _significant(name: str, diagnosis: Diagnosis, trace: Trace, cutoff_hz: float) -> str:
    gap, unit = diagnosis.axes[name], diagnosis.units[name]
    position_unit, velocity_unit = ("m", "m/s") if unit == "N" else ("rad", "rad/s")
    over_velocity = torque_figure(trace, unit, velocity_unit), gap_figure(trace, unit, velocity_unit)
    spectra = spectra_of(diagnosis.predictions, name, gap.noise_rms, cutoff_hz)
    left = spectrum_figure(spectra, unit), left_figure(trace, gap.noise_rms, unit)
    return (
        f"{_over_time(trace, unit)}{pictured('Over velocity', *over_velocity)}"
        f"{pictured('Where the gap is', *map_figures(gap_map(trace), unit, position_unit, velocity_unit))}"
        f"{_where(gap, velocity_unit)}"
        f"<h3>What is left</h3>{_remains(name, diagnosis)}{pictured('What is left, against noise', *left)}"
    )


def _over_time(trace: Trace, unit: str) -> str:
    title = "Measured and simulated over time, opened where the gap is worst"
    return pictured(title, time_figure(trace, worst_window(trace, _WINDOW), unit))


def _where(gap: AxisGap, velocity_unit: str) -> str:
    """The regimes before and after, and what the gap varies over."""
    after = {each.regime: each.share for each in gap.where_after}
    regimes = [
        [
            escape(name_of(each.regime)),
            _bounds(each, velocity_unit),
            f"{bar(each.share)}{percent(each.share)}",
            f"{bar(after[each.regime])}{percent(after[each.regime])}" if each.regime in after else DASH,
        ]
        for each in gap.where
    ]
    patterns = [
        [escape(name_of(each.over)), f"{bar(each.share)}{percent(each.share)}", escape(each.detail)] for each in gap.patterns
    ]
    head = ["Regime", "Bounds", "Share of the gap", "Of what is left"]
    varies = stacking_table(["Varies over", "Share of the gap", "How"], patterns) if patterns else ""
    return f"{stacking_table(head, regimes)}{varies}"


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
        f"{_MAGNITUDES.get(name, name)} {span(low, high, units[name], 3)}"
        for name, (low, high) in regime.interval.items()
    )


def _remains(axis: str, diagnosis: Diagnosis) -> str:
    """What the unknown goes with, in which regime most of it is, and when."""
    gap, unit = diagnosis.axes[axis], diagnosis.units[axis]
    left = f"{level(diagnosis.after_rms[axis], unit)} rms is left, of which noise is {level(gap.noise_rms, unit)}."
    if not gap.where_after:
        return f"<p>{escape(left)} Nothing of it is above noise.</p>"
    unknown = f"The unknown, {percent(gap.unknown.share)} of the gap, {goes_with_words(gap.unknown)}."
    most = max(gap.where_after, key=lambda regime: regime.share)
    place = f"{percent(most.share)} of what is left above noise is in the regime {name_of(most.regime)}."
    return f"<p>{escape(f'{left} {unknown} {place}')}</p>{_intervals(axis, diagnosis)}"


def _intervals(axis: str, diagnosis: Diagnosis) -> str:
    """When most of what is left is; empty where it is spread evenly."""
    intervals, unit = intervals_after(diagnosis, axis), diagnosis.units[axis]
    if not intervals:
        return ""
    share = percent(sum(interval.share for interval in intervals))
    rows = [
        [escape(each.recording), _tight(time_words(each)), escape(level(each.rms, unit)), percent(each.share)]
        for each in intervals[:_INTERVALS_SHOWN]
    ]
    head = ["Recording", "Time", "Level, rms", "Share"]
    return f"<p>{share} of its energy is in {interval_words(len(intervals))}; the largest:</p>{plain_table(head, rows, (2, 3))}"


def _tight(words: str) -> str:
    return f'<span class="tight">{words}</span>'


def _not_testable(gap: AxisGap) -> str:
    """One row a reason."""
    rows = [
        [escape(listed([name_of(effect) for effect in each.effects])), escape(each.reason), _with_code(each.needed)]
        for each in untested(gap.not_testable)
    ]
    if not rows:
        return ""
    return f"<h3>What could not be tested</h3>{stacking_table(['Effect', 'Reason', 'What to record or give'], rows)}"


def _with_code(words: str) -> str:
    """Names between back quotes as code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", escape(words))
