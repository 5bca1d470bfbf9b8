"""What `drivetwin diagnose` says in the terminal: the verdict, the gap of each axis, its causes, what else to know."""

from __future__ import annotations

from collections.abc import Iterator

from rich import box
from rich.console import Console
from rich.table import Table

from drivetwin.diagnosis.report.remains import intervals_after
from drivetwin.diagnosis.report.result import UNKNOWN, Cause, Diagnosis
from drivetwin.diagnosis.report.wording import (
    LIKELY,
    chance,
    closed,
    estimate_words,
    goes_with_words,
    interval_words,
    level,
    listed,
    mass_words,
    name_of,
    of_torque,
    percent,
    residual_words,
    shrinks,
    time_words,
    undistinguished,
    untested,
    verdict_sentence,
)
from drivetwin.foundation.quantities import number, scale_of
from drivetwin.twin.comparison import SIGNALS

_SHOWN_AT_MOST = 3
"""Intervals that are named."""


def print_summary(console: Console, found: Diagnosis) -> None:
    """Verdict, tables and hints."""
    console.print(verdict_sentence(found), highlight=False)
    console.print(_gaps(found))
    if found.closed_loop:
        console.print(_closed_loop(found))
    if found.causes:
        console.print(_causes(found))
    if found.masses:
        console.print(_masses(found))
    for line in _hints(found):
        console.print(line, highlight=False)


def _gaps(found: Diagnosis) -> Table:
    data = "blocks held back from the recordings" if found.held_back else "the validation recordings"
    table = Table(title=f"Gap on {data}, rms in motion (share of the torque)", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("axis", no_wrap=True)
    for name in ("gap", "noise", "after"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for name in ("closed", "unknown"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("most of it in", no_wrap=True)
    for name, gap in found.axes.items():
        after = found.after_rms[name]
        scale = scale_of(found.units[name], gap.gap_rms)
        noise = number(scale.factor * gap.noise_rms)
        levels = [of_torque(gap.gap_rms, gap, scale), noise, of_torque(after, gap, scale)]
        most = max(gap.where, key=lambda regime: regime.share, default=None)
        place = f"{name_of(most.regime)} {percent(most.share)}" if most else ""
        shares = [percent(closed(gap, after)), percent(gap.unknown.share), place]
        table.add_row(name, *levels, scale.unit, *(shares if gap.significant else ["", "", "no gap beyond noise"]))
    return table


def _closed_loop(found: Diagnosis) -> Table:
    title = "The same in closed loop, measured less simulated over measured: the model, and with the effects"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("recording", "axis"):
        table.add_column(name, no_wrap=True)
    for name in SIGNALS:
        table.add_column(name.replace("_", " "), justify="right")
    for each in found.closed_loop:
        for name, axis in each.moving.items():
            table.add_row(each.recording, name, *(shrinks(axis, signal) for signal in SIGNALS))
    return table


def _causes(found: Diagnosis) -> Table:
    table = Table(title="Causes, by probability times share of the gap", title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("cause", "axis"):
        table.add_column(name, no_wrap=True)
    for name in ("probability", "share"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("parameters (90 % interval)")
    for cause in found.causes:
        if cause.probability >= LIKELY:
            figures = chance(cause.probability), percent(cause.share)
            table.add_row(name_of(cause.effect), cause.axis, *figures, _told(cause, found))
    return table


def _masses(found: Diagnosis) -> Table:
    title = "Masses that differ from the model's, inertia in proportion (90 % interval)"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("body", "most on axis"):
        table.add_column(name, no_wrap=True)
    table.add_column("share", justify="right", no_wrap=True)
    for name in ("in the model", "found"):
        table.add_column(name)
    for one in found.masses:
        table.add_row(one.body, one.axis, percent(one.share), *mass_words(one))
    return table


def _told(cause: Cause, found: Diagnosis) -> str:
    if cause.effect == UNKNOWN:
        return goes_with_words(found.axes[cause.axis].unknown)
    return "\n".join(estimate_words(name, estimate) for name, estimate in cause.parameters.items())


def _hints(found: Diagnosis) -> Iterator[str]:
    """What these data cannot distinguish or test, when most of what is left is, and what else the reader needs to know."""
    for cause in found.causes:
        if cause.indistinguishable_from and cause.probability >= LIKELY:
            yield undistinguished(cause)
    for axis, gap in found.axes.items():
        intervals = intervals_after(found, axis) if gap.significant else ()
        if intervals:
            share = percent(sum(interval.share for interval in intervals))
            largest = ", ".join(f"{time_words(interval)} of {interval.recording}" for interval in intervals[:_SHOWN_AT_MOST])
            left = level(found.after_rms[axis], found.units[axis])
            yield f"left on {axis}, {left} rms: {share} of its energy in {interval_words(len(intervals))}, most at {largest}"
    for axes, effects, reason, needed in _untested(found):
        yield f"not testable on {axes}: {effects} ({reason}; needed: {needed})"
    if found.residual:
        yield residual_words(found)
    yield from found.notes


def _untested(found: Diagnosis) -> Iterator[tuple[str, str, str, str]]:
    """One line a reason and its effects, of all axes for which they are the same."""
    axes: dict[tuple[str, str, str], list[str]] = {}
    for axis, gap in found.axes.items():
        for each in untested(gap.not_testable):
            effects = listed([name_of(effect) for effect in each.effects])
            axes.setdefault((effects, each.reason, each.needed), []).append(axis)
    for line, names in axes.items():
        yield listed(names), *line
