"""`drivetwin accept`: a controller release against the virtual machine, case by case; accepted or rejected, and why."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.live import AsLive, Live, live
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import own_directory
from drivetwin.hil_tests.bench import Bench, UnmeantError, read_bench
from drivetwin.hil_tests.folder import digest
from drivetwin.hil_tests.motion_plan import what_moves
from drivetwin.hil_tests.results import (
    Acceptance,
    Trend,
    check_baseline,
    compare,
    read_results,
    write_junit,
    write_report,
    write_results,
)
from drivetwin.hil_tests.results.trend import Change, Kind
from drivetwin.hil_tests.results.wording import case_name, caveats, failure_words, verdict_sentence
from drivetwin.hil_tests.run import run_all
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.hil_tests.verdict import CaseResult, Outcome

REJECTED = 1
"""Exit status where the controller is rejected."""

_STYLES = {Outcome.ACCEPTED: "green", Outcome.REJECTED: "red", Outcome.SKIPPED: "yellow"}


def accept_command(
    bench: Annotated[Path, typer.Option(metavar="FILE", help="The bench (bench/1): machine, bus, controller, limits.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder for results and cases.")] = Path("out/accept"),
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="JUnit XML; default DIR/junit.xml.")] = None,
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="The report; default DIR/report.html.")] = None,
    select: Annotated[
        list[str] | None, typer.Option(help="Only these cases: a group's number, or a name with wildcards (04_moves.*).")
    ] = None,
    cases: Annotated[
        list[Path] | None, typer.Option(metavar="DIR", help="Cases of your own (DIR/NN_group/name.yaml) beside the product's.")
    ] = None,
    baseline: Annotated[
        Path | None, typer.Option(metavar="FILE", help="results.json of an earlier release; worse quantities reject.")
    ] = None,
    clock: Annotated[str | None, typer.Option(help="sync or realtime; overrides the bench.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the sensors' noise; overrides the bench.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Cases at once; default: one per core.", show_default=False)] = None,
    real: Annotated[
        bool, typer.Option("--real", help="The bench has real drives (drives: real), the machine is clear: axes may move.")
    ] = False,
    effects_from: EffectsFrom = None,
    as_live: AsLive = False,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Run a controller through the acceptance suite.

    Starts the controller once per case, as the bench file defines, on virtual drives of the machine, and compares its behaviour
    with the requirements. DIR receives report.html, junit.xml, results.json, and for each case the bus log, the truth and the
    output of the controller.

    On a bench of real drives it only listens to their bus. It first lists what will move, leaves out cases with faults and
    figures that need the plant's truth, and stops after the first rejected case. Without --real it only prints the list.

    Exit status: 0 accepted, 1 rejected, 2 a wrong bench or case.

    Example: drivetwin accept --bench hil_tests/benches/scara.yaml --select 4 --out out/accept
    """
    use_effects(effects_from)
    console = terminal(silent=quiet or json_, markup=False)  # it tells what others wrote, as they wrote it
    folders = [CASES, *(cases or ())]
    try:
        chosen = read_bench(bench, real, _instead(clock, seed))
    except UnmeantError as refusal:
        _warn(terminal(markup=False), refusal.bench, find_cases(refusal.bench, folders, select or ()))
        raise
    scenarios = find_cases(chosen, folders, select or ())
    _tell_skipped(console, scenarios)
    before = None if baseline is None else read_results(baseline)
    if before is not None:
        check_baseline(chosen, before)
    own_directory(out)
    if chosen.drives == "real":
        _warn(console, chosen, scenarios)
    page = html or out / "report.html"
    with live(as_live, f"accept {chosen.controller.name} on {chosen.machine_name}") as telling:
        results = _run(console, telling, chosen, scenarios, out, jobs or os.cpu_count() or 1)
        acceptance = Acceptance(chosen, tuple(results), digest([one.folder for one in results if one.folder is not None]))
        trend = None if before is None else compare(acceptance, before)
        write_junit(acceptance, junit or out / "junit.xml", Path.cwd(), trend)
        write_report(acceptance, page, trend)
        # the last of all: an OUT that has it is complete
        write_results(acceptance, out / "results.json", [chosen.path, *(scenario.path for scenario in scenarios)])
        _tell(console, acceptance, trend, page)
        if json_:
            print((out / "results.json").read_text(encoding="utf-8"), end="", flush=True)
        telling.done(verdict_sentence(acceptance, len(_worse(trend))), page)
    if not acceptance.accepted or (trend is not None and trend.rejects):
        raise typer.Exit(REJECTED)


def _instead(clock: str | None, seed: int | None) -> dict[str, object]:
    """Keys of the bench that the command line replaces."""
    if clock not in (None, "sync", "realtime"):
        raise UserError(f"unknown clock {clock!r}; expected sync or realtime")
    return {key: value for key, value in (("clock", clock), ("seed", seed)) if value is not None}


def _warn(console: Console, bench: Bench, scenarios: Sequence[Scenario]) -> None:
    """What will move, for whoever stands beside the machine."""
    console.print(f"Real drives on {bench.bus}. What the controller may do, and its tasks:", style="yellow")
    for line in what_moves(scenarios, bench):
        console.print(f"  {line}", highlight=False, soft_wrap=True)


def _tell_skipped(console: Console, scenarios: Sequence[Scenario]) -> None:
    """First of all what will not be judged."""
    skipped = [case.identity for case in scenarios if case.skipped_because is not None]
    left_out = f"; skipped, and not judged: {', '.join(skipped)}" if skipped else ""
    console.print(f"{len(scenarios)} cases{left_out}", highlight=False, soft_wrap=True)


def _run(
    console: Console, telling: Live, bench: Bench, scenarios: Sequence[Scenario], out: Path, jobs: int
) -> list[CaseResult]:
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bars:
        task = bars.add_task(f"{bench.controller.name} on {bench.machine_name}", total=len(scenarios))
        watch = _Watch(bars, task, telling, len(scenarios))
        return run_all(bench, scenarios, out.absolute() / "cases", jobs, watch.done)


class _Watch:
    """Counts cases on a progress bar, and tells at once which was rejected."""

    def __init__(self, bars: Progress, task: TaskID, telling: Live, cases: int) -> None:
        self._bars, self._task, self._telling = bars, task, telling
        self._cases, self._done = cases, 0

    def done(self, result: CaseResult) -> None:
        self._bars.advance(self._task)
        self._done += 1
        self._telling.whole(self._done / self._cases)
        self._telling.say(f"{result.outcome}: {case_name(result)}")
        if result.outcome is Outcome.REJECTED:
            self._bars.console.print(f"rejected: {case_name(result)}", style="red", highlight=False)


def _tell(console: Console, acceptance: Acceptance, trend: Trend | None, report: Path) -> None:
    """The table of cases, what failed, and the verdict."""
    console.print(_table(acceptance.cases))
    for case in acceptance.of(Outcome.REJECTED):
        for failure in case.failures:
            console.print(f"{case_name(case)}: {failure_words(failure)}", style="red", highlight=False, soft_wrap=True)
    worse = _worse(trend)
    for change in worse:
        console.print(f"worse than the baseline: {change.words}", style="red", highlight=False, soft_wrap=True)
    console.print(verdict_sentence(acceptance, len(worse)), highlight=False, soft_wrap=True)
    if acceptance.bench.clock == "sync":
        console.print(f"digest {acceptance.digest}", highlight=False, soft_wrap=True)
    console.print(f"report: {report}", highlight=False, soft_wrap=True)


def _worse(trend: Trend | None) -> tuple[Change, ...]:
    return () if trend is None else trend.of(Kind.REGRESSION)


def _table(cases: Sequence[CaseResult]) -> Table:
    table = Table(box=box.SIMPLE_HEAD)
    for name in ("case", "requirement"):
        table.add_column(name)
    table.add_column("time", justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for case in cases:
        simulated = f"{case.simulated:.1f} s" if case.folder is not None else ""
        more = case.skipped_because or "; ".join(caveats(case))
        about = f"{case.title}: {more}" if more else case.title
        table.add_row(case_name(case), about, simulated, Text(case.outcome, _STYLES[case.outcome]))
    return table
