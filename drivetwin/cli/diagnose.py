"""`drivetwin diagnose`: where a simulation and a machine's recordings differ, why, and how far the gap shrinks."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from drivetwin.cli.diagnose_summary import print_summary
from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.live import AsLive, live
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.inputs import read_inputs
from drivetwin.diagnosis.report.closed_loop import in_closed_loop
from drivetwin.diagnosis.report.frequency_response import with_responses
from drivetwin.diagnosis.report.wording import verdict_sentence
from drivetwin.diagnosis.report.write import write_diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, refuse_foreign, refuse_to_replace

FAILED = 1
"""Exit status where the verdict is one that --fail-on names."""


class FailOn(StrEnum):
    """Which verdicts fail a build."""

    GAP = "gap"
    UNEXPLAINED = "unexplained"

    def fails(self, verdict: str) -> bool:
        """`gap`: any verdict but no_gap; `unexplained`: that one."""
        return verdict != "no_gap" if self is FailOn.GAP else verdict == "unexplained"


def diagnose_command(
    model: Annotated[Path, typer.Argument(metavar="MODEL.xml", help="MuJoCo model (MJCF): the simulation as it stands.")],
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING...", help="Training recordings, or folders of recordings.")
    ],
    *,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder for report.html, report.json and patched.xml.")],
    validate: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING...", help="Validation recordings, not fitted; all paths up to the next option."),
    ] = None,
    cutoff: Annotated[
        float | None, typer.Option(metavar="HZ", help="Cut-off frequency of the filter, in Hz; default: from the recordings.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random draws for intervals and probabilities.")] = 0,
    allow_gaps: Annotated[bool, typer.Option("--allow-gaps", help="Split a recording at lost samples.")] = False,
    with_residual: Annotated[
        bool, typer.Option("--with-residual", help="Also patch what has no name, as a table over position and velocity.")
    ] = False,
    no_html: Annotated[bool, typer.Option("--no-html", help="Do not write report.html.")] = False,
    effects_from: EffectsFrom = None,
    as_live: AsLive = False,
    fail_on: Annotated[
        FailOn | None, typer.Option(help="Exit status 1 on any gap (gap), or on an unexplained one (unexplained).")
    ] = None,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Find where the simulation and the machine differ, which unmodelled effect causes it, and how far the gap shrinks.

    Example: drivetwin diagnose docs/examples/emps/model.xml out/emps --validate out/emps_pulses --out out/emps_gap

    Writes report.html and report.json, the simulation with the effects added (patched.xml, effects.json), and what it
    predicts for every validation recording (prediction/). Without --validate blocks of the recordings are held back.
    docs/diagnosis.md explains how to read the report.

    With --with-residual, effects.json also has a table of what no effect explains, so that the simulation comes closer where
    the gap has no name. It is no cause, and it is left out where it makes the validation worse.

    Example: drivetwin diagnose model.xml out/strokes --with-residual --out out/closer

    Exit status: 0 with a report, whatever the verdict; 1 where --fail-on names that verdict; 2 an input that is refused.
    """
    console = terminal(silent=quiet or json_)
    refuse_foreign(out)
    use_effects(effects_from)
    if as_live and no_html:
        raise UserError("--live shows the report in the browser: leave --no-html out")
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with live(as_live, f"diagnose {model.name}") as telling:
        telling.phase("reading")
        inputs = read_inputs(model, recordings, validate or [], cutoff_hz=cutoff, allow_gaps=allow_gaps)
        files = [*inputs.files, *(effects_from or ())]
        refuse_to_replace(out, files)
        with Progress(*columns, console=console, transient=True) as bars:  # it ends with a line of its own
            task = bars.add_task("diagnosing", total=1.0)

            def progress(what: str, share: float = 1.0) -> None:
                bars.update(task, description=what, completed=share)
                telling.phase(what)
                telling.whole(share)

            settings = Settings(cutoff_hz=cutoff, seed=seed)
            found = diagnose(model, inputs.training, inputs.validation, settings, progress, with_residual)
            progress("in closed loop", 0.95)
            found = in_closed_loop(found, model)
            progress("over frequency", 0.97)
            found = with_responses(found, [*inputs.training, *inputs.validation])
            with new_directory(out) as staged:
                write_diagnosis(found, files, staged, html=not no_html, progress=progress)
        print_summary(console, found)
        console.print(_written(out, no_html), highlight=False, soft_wrap=True)
        if json_:
            print((out / "report.json").read_text(encoding="utf-8"), end="", flush=True)
        telling.done(verdict_sentence(found), out / "report.html")
    if fail_on is not None and fail_on.fails(found.verdict):
        raise typer.Exit(FAILED)


def _written(out: Path, no_html: bool) -> str:
    return "  ".join(str(out / name) for name in ([] if no_html else ["report.html"]) + ["report.json", "patched.xml"])
