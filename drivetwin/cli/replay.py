"""`drivetwin replay`: the model moved as the machine was moved, in closed loop, and how far apart they are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from drivetwin.cli.effects_from import EffectsFrom, say_what_lies_beside, use_effects
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.emulator.effects import read_effects
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, refuse_foreign, refuse_to_replace
from drivetwin.foundation.machine_picture import machine_picture
from drivetwin.foundation.page_table import DASH
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.twin.comparison import SIGNALS, Comparison, compared
from drivetwin.twin.page import NAMES, relative
from drivetwin.twin.recordings import read_for
from drivetwin.twin.write import write_replay


def replay_command(
    model: Annotated[Path, typer.Argument(metavar="MODEL.xml", help="MuJoCo model (MJCF): the simulation to be moved.")],
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING...", help="Recordings with demand, or folders of recordings.")
    ],
    *,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where replay.html, replay.json and signals/ appear.")],
    effects: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Effects (effects/1): the model is moved without and with them.")
    ] = None,
    cutoff: Annotated[float, typer.Option(metavar="HZ", help="Cut-off of the filter applied before the comparison.")] = 48.0,
    allow_gaps: Annotated[bool, typer.Option("--allow-gaps", help="Split a recording at lost samples.")] = False,
    no_html: Annotated[bool, typer.Option("--no-html", help="Do not write replay.html.")] = False,
    effects_from: EffectsFrom = None,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Move a model as a machine was moved, in closed loop, and report the differences.

    Example: drivetwin replay out/emps_twin.xml out/emps out/emps_pulses --effects out/emps_twin.effects.json --out out/replay

    The drive's loops are those of `drive` in recording.json, or else the model's own position or velocity actuators.
    docs/replay.md describes what is compared, and how.
    """
    console = terminal(silent=quiet or json_)
    if not cutoff > 0.0:
        raise UserError(f"--cutoff {cutoff:g}: expected a frequency above 0 Hz")
    refuse_foreign(out)
    use_effects(effects_from)
    say_what_lies_beside(model, effects)
    placed = None if effects is None else read_effects(effects)
    read = read_for(model, recordings, cutoff, allow_gaps=allow_gaps)
    recorded = [file for each in read for file in each.files]
    files = [model, *([] if effects is None else [effects]), *(effects_from or ()), *recorded]
    refuse_to_replace(out, files)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    found = []
    with Progress(*columns, console=console, transient=True) as bars:
        task = bars.add_task("replaying", total=len(read))
        for recording in read:
            bars.update(task, description=f"replaying {recording.name}")
            found.append(compared(model, recording, placed, cutoff))
            bars.advance(task)
        with new_directory(out) as staged:
            write_replay(found, _picture(model, read), list(dict.fromkeys(files)), staged, html=not no_html)
    console.print(_table(found))
    if any(len(each.moving) < len(each.axes) for each in found):
        console.print("Axes at rest in a recording are not shown; replay.json contains them.", highlight=False)
    written = [*([] if no_html else ["replay.html"]), "replay.json"]
    console.print("  ".join(str(out / name) for name in written), highlight=False, soft_wrap=True)
    if json_:
        print((out / "replay.json").read_text(encoding="utf-8"), end="")


def _picture(model: Path, recordings: Sequence[Recording]) -> str:
    """The model as SVG, its recorded joints marked."""
    return machine_picture(read_mjcf(model), {axis.joint for each in recordings for axis in each.info.axes.values()})


def _table(found: Sequence[Comparison]) -> Table:
    table = Table("recording", "axis", "run", *(name.replace("_", " ") for name in SIGNALS))
    for each in found:
        for name, axis in each.moving.items():
            for run in axis.runs:
                cells = (relative(axis, run, signal).replace(DASH, "-") for signal in SIGNALS)
                table.add_row(each.recording, name, NAMES[run], *cells)
    return table
