"""What `drivetwin diagnose` says in the terminal: the verdict, the gap of each axis, the first causes, what else to know."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from rich import box
from rich.console import Console
from rich.table import Table

from diagnosis.remains import spells_after
from diagnosis.result import Cause, Diagnosis
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

_SHOWN_FROM = 0.05
"""Probability from which an answer beside the first has a line of its own."""
_SHOWN_AT_MOST = 3
"""Spells that are named."""


def print_summary(console: Console, found: Diagnosis) -> None:
    """Verdict, tables and hints."""
    console.print(verdict_sentence(found), highlight=False)
    console.print(_gaps(found))
    console.print(_causes(found))
    for line in _hints(found):
        console.print(line, highlight=False)


def _gaps(found: Diagnosis) -> Table:
    table = Table(title=_over(found), title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("axis", no_wrap=True)
    for name in ("gap", "noise", "after"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for name in ("closed", "of explainable"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("most in", no_wrap=True)
    for name in found.axes:
        gap, after = found.told(name)
        levels = [of_torque(gap.gap_rms, gap), number(gap.noise_rms), of_torque(after, gap)]
        explained = closed_of_explainable(gap, after)
        shares = [percent(closed(gap, after)), percent(explained) if explained is not None else ""]
        most = max(gap.where, key=lambda regime: regime.share, default=None)
        place = f"{most.regime.replace('_', ' ')} {percent(most.share)}" if most else ""
        row = [*shares, place] if gap.significant else ["", "", "no gap beyond noise"]
        table.add_row(name, *levels, found.units[name], *row)
    return table


def _over(found: Diagnosis) -> str:
    data = "blocks held back from the recordings" if found.held_back else "the validation recordings"
    fitted = f", of {', '.join(found.fitted)} on the fitted ones" if found.fitted else ""
    return f"Gap on {data}{fitted}, rms in motion (share of the torque)"


def _causes(found: Diagnosis) -> Table:
    table = Table(title="Causes, step by step", title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("step", justify="right")
    table.add_column("cause", no_wrap=True)
    table.add_column("probability", justify="right", no_wrap=True)
    table.add_column("parameters (90 % interval)")
    for step, causes in groupby(found.causes, key=lambda cause: cause.step):
        told = list(causes)
        likely = _likely(told)
        for row, cause in enumerate(likely):
            parameters = "\n".join(estimate_words(name, estimate) for name, estimate in cause.parameters.items())
            table.add_row(str(step) if row == 0 else "", cause_name(cause), number(cause.probability), parameters)
        if others := told[len(likely) :]:
            table.add_row("", others_words(len(others)), number(sum(cause.probability for cause in others)), "")
        table.add_section()
    return table


def _likely(causes: list[Cause]) -> list[Cause]:
    """The first, and whatever else is not far-fetched."""
    return [cause for rank, cause in enumerate(causes) if rank == 0 or cause.probability >= _SHOWN_FROM]


def _hints(found: Diagnosis) -> Iterator[str]:
    """What cannot be told apart by these data, and what else the reader needs to know."""
    for _, causes in groupby(found.causes, key=lambda cause: cause.step):
        first = next(causes)
        if first.indistinguishable_from:
            others = ", ".join(name_of(effect) for effect in first.indistinguishable_from)
            told_by = f"; told apart by {first.tell_apart_by}" if first.tell_apart_by else ""
            yield f"{cause_name(first)} or {others}: these data cannot tell{told_by}"
    for axis, gap in found.axes.items():
        spells = spells_after(found, axis) if gap.significant else ()
        if spells:
            share = percent(sum(spell.share for spell in spells))
            largest = ", ".join(f"{time_words(spell)} of {spell.recording}" for spell in spells[:_SHOWN_AT_MOST])
            level = f"{number(found.told(axis)[1])} {found.units[axis]} rms"
            yield f"what is left on {axis}, {level}: {share} of its energy in {spells_words(len(spells))}, most at {largest}"
    yield from found.notes
