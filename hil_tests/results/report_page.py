"""report.html: one file that needs no network; rejected cases are open, accepted cases are folded."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby
from pathlib import Path

import mujoco

from drivetwin.emulator.machine import Machine
from drivetwin.foundation.html_page import table, write_page
from drivetwin.foundation.machine_picture import machine_picture
from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.results.pdo_words import ordered_pdos
from drivetwin.hil_tests.results.report_bars import bar, used
from drivetwin.hil_tests.results.report_case import anchor, folded_case, rejected_section
from drivetwin.hil_tests.results.trend import Change, Kind, Trend
from drivetwin.hil_tests.results.wording import against, case_name, quantity, quantity_name, suite_name, verdict_sentence
from drivetwin.hil_tests.verdict import CaseResult, Failure, Measured, Outcome

_FIGURES_SHOWN = 3
"""Of a case in the overview: those nearest to their limit."""

_STYLE = """<style>
.verdict { font-size: 18px; margin: 4px 0 12px; } .verdict.good { color: var(--good); } .verdict.bad { color: var(--bad); }
.bar { display: inline-block; width: 90px; height: 9px; background: #e8edf1; border-radius: 5px; margin-right: 8px; }
.bar i { display: block; height: 100%; background: var(--accent); border-radius: 5px; min-width: 2px; max-width: 100%; }
.bar.over i { background: var(--bad); } .wrap { white-space: normal; display: inline-block; max-width: 420px; }
td { vertical-align: top; } .small { font-size: 13px; } .case { font-weight: 600; }
.group { display: inline-block; padding-top: 14px; color: var(--accent); font-weight: 600; }
.rejected { border-left: 4px solid var(--bad); } td code { font-size: 12px; } a { color: var(--accent); }
pre { background: #f4f6f8; padding: 10px 12px; white-space: pre-wrap; font-size: 12px; }
details { border-bottom: 1px solid var(--line); padding: 6px 0; } summary { cursor: pointer; }
</style>"""
_DRAW_WHEN_OPENED = """<script>
document.addEventListener("toggle", event => {
  const kept = event.target.querySelector(":scope > template");
  if (event.target.open && kept) kept.replaceWith(document.importNode(kept.content, true));
}, true);
const openNamed = () => {
  const named = document.getElementById(location.hash.slice(1));
  if (named && named.tagName === "DETAILS") named.open = true;
};
addEventListener("hashchange", openNamed);
addEventListener("load", openNamed);
</script>"""
"""A browser that opens one picture draws one, not a hundred; a link to a folded case opens it."""


def write_report(acceptance: Acceptance, path: Path, trend: Trend | None = None) -> None:
    """Write the report to `path`, whole or not at all; logs and truth are taken from the folders of the cases."""
    bench, pdos = acceptance.bench, ordered_pdos(acceptance.bench)
    title = f"Acceptance of {bench.controller.name}"
    facts = (
        f"Machine {bench.machine_name}, drives {bench.profile}, bus {bench.bus} at {bench.bit_rate / 1000:g} kbit/s, "
        f"clock {bench.clock}, cycle {quantity(bench.cycle, 's')}, seed {bench.seed}"
    )
    body = [
        f"{_STYLE}{_DRAW_WHEN_OPENED}<header><h1>{escape(title)}</h1><p>{escape(facts)}</p></header>",
        _verdict(acceptance, trend),
        _overview(acceptance.cases),
        *(rejected_section(case, pdos) for case in acceptance.of(Outcome.REJECTED)),
        *([_trend(trend)] if trend is not None else []),
        _machine(acceptance.bench.virtual),
        _accepted(acceptance.of(Outcome.ACCEPTED)),
        _how(acceptance),
    ]
    write_page(path, title, [section for section in body if section])


def _verdict(acceptance: Acceptance, trend: Trend | None) -> str:
    worse = len(trend.of(Kind.REGRESSION)) if trend is not None else 0
    kind = "good" if acceptance.accepted and not worse else "bad"
    lines = [f'<p class="verdict {kind}">{escape(verdict_sentence(acceptance, worse))}</p>']
    for case in acceptance.of(Outcome.REJECTED):
        first = f": {_failure_line(case.failures[0])}" if case.failures else ""
        lines.append(f'<p><a href="#{anchor(case)}">{escape(case_name(case))}</a> {escape(case.title)}{first}</p>')
    return f"<section><h2>Verdict</h2>{''.join(lines)}</section>"


def _machine(machine: Machine) -> str:
    """A picture of the machine, its axes marked by the names of their joints."""
    joints = {axis.joint for axis in machine.axes.values()}
    picture = machine_picture(mujoco.MjModel.from_xml_path(str(machine.model_path)), joints)
    return f"<section><h2>Machine</h2>{picture}</section>" if picture else ""


def _failure_line(failure: Failure) -> str:
    facts = [failure.axis or "", "" if failure.time is None else f"at {failure.time:.3f} s"]
    said = ", ".join(fact for fact in facts if fact)
    return f"{escape(failure.message)}{f' <span class=note>({escape(said)})</span>' if said else ''}"


def _overview(cases: Sequence[CaseResult]) -> str:
    rows = [row for name, group in groupby(cases, key=suite_name) for row in _group(name, group)]
    note = "Bars: share of the limit that is used; of each case the figures nearest to their limits."
    shown = table(["Case", "Requirement", "Verdict", "Figures"], rows, numeric=())
    return f'<section><h2>Cases</h2>{shown}<p class="note">{note}</p></section>'


def _group(name: str, cases: Iterable[CaseResult]) -> list[list[str]]:
    """A row that names the group, then one a case."""
    rows = [
        [
            _named(case),
            f'<span class="wrap small">{escape(case.title)}<br><span class="note">{escape(case.requirement)}</span></span>',
            _outcome(case),
            f'<span class="small">{"<br>".join(_bar_line(measured) for measured in _nearest(case))}</span>',
        ]
        for case in cases
    ]
    return [[f'<span class="group">{escape(name.replace("_", " "))}</span>'], *rows]


def _named(case: CaseResult) -> str:
    if case.outcome is Outcome.SKIPPED:
        return f'<span class="case">{escape(case.name)}</span>'
    return f'<a class="case" href="#{anchor(case)}">{escape(case.name)}</a>'


def _outcome(case: CaseResult) -> str:
    if case.outcome is Outcome.SKIPPED:
        return f'<span class="wrap note" style="max-width:180px">skipped: {escape(case.skipped_because)}</span>'
    return f'<span class="{"in" if case.outcome is Outcome.ACCEPTED else "out"}">{case.outcome}</span>'


def _nearest(case: CaseResult) -> list[Measured]:
    limited = [measured for measured in case.measured if measured.limit is not None]
    return sorted(limited, key=used, reverse=True)[:_FIGURES_SHOWN]


def _bar_line(measured: Measured) -> str:
    figures = against(measured.value, measured.limit or 0.0, measured.unit)
    name = quantity_name(measured.name, measured.axis)
    return f"{bar(used(measured))}{escape(name)}: {escape(figures)}"


def _accepted(cases: Sequence[CaseResult]) -> str:
    if not cases:
        return ""
    return f"<section><h2>Accepted cases</h2>{''.join(folded_case(case) for case in cases)}</section>"


_SHOWN_KINDS = (Kind.REGRESSION, Kind.IMPROVEMENT, Kind.NOISE_UNKNOWN, Kind.NEW, Kind.GONE)


def _trend(trend: Trend) -> str:
    changes = [change for kind in _SHOWN_KINDS for change in trend.of(kind)]
    kept = len(trend.of(Kind.WITHIN_NOISE))
    head = ["Change", "Case", "Figure", "Before", "Now", "Tolerance"]
    figures = table(head, [_change(each) for each in changes], numeric=(3, 4, 5))
    outcomes = table(
        ["Case", "Before", "Now"],
        [[escape(case.case), case.before or "not there", case.now or "not there"] for case in trend.cases],
        numeric=(),
    )
    return (
        f"<section><h2>Against the baseline</h2><p>Baseline: {escape(trend.controller)}, drivetwin {escape(trend.version)}. "
        f"{kept} figures differ by no more than their tolerance.</p>"
        f"{figures if changes else ''}{outcomes if trend.cases else ''}"
        '<p class="note">The tolerance is 3 standard deviations of the difference of two runs, and no less than what the '
        "figure is resolved to. A figure that is worse by more rejects the release; one with unknown noise is only reported."
        "</p></section>"
    )


def _change(change: Change) -> list[str]:
    kind = {Kind.REGRESSION: "out", Kind.IMPROVEMENT: "in"}.get(change.kind, "note")
    figures = [
        "&ndash;" if value is None else escape(quantity(value, change.unit))
        for value in (change.before, change.now, change.tolerance)
    ]
    name = quantity_name(change.name, change.axis)
    return [f'<span class="{kind}">{change.kind}</span>', escape(change.case), escape(name), *figures]


def _how(acceptance: Acceptance) -> str:
    notes = _how_with_real_drives(acceptance) if acceptance.bench.drives == "real" else _how_with_virtual_drives(acceptance)
    return f"<section><h2>How it was done</h2><ul>{''.join(f'<li>{note}</li>' for note in notes)}</ul></section>"


def _how_with_real_drives(acceptance: Acceptance) -> list[str]:
    return [
        f"The drives were real, on {escape(acceptance.bench.bus)}; the bus was listened to, and nothing sent.",
        "Nothing is known of the plant's truth: what is held against it was not judged, and is named with each case.",
        "Times are those of the wall clock, from the beginning of each case.",
    ]


def _how_with_virtual_drives(acceptance: Acceptance) -> list[str]:
    bench = acceptance.bench
    truth = f"the plant's truth is {bench.truth.as_posix()}" if bench.truth else "the plant has the machine's own true effects"
    timing = "the wire is modelled" if bench.bit_timing else "frames take no time; the load is that of a physical bus"
    simulated = sum(case.simulated for case in acceptance.cases)
    return [
        "Positions, tracking errors and torques are the plant's own, not what the drives say of them.",
        "Times are simulated, from power on of each case.",
        f"Bench: {escape(truth)}; {timing}.",
        f"{simulated:.4g} s simulated in {len(acceptance.cases)} cases.",
        f"Digest, the same in every lockstep run: <code>{escape(acceptance.digest)}</code>.",
    ]
