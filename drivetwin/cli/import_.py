"""`drivetwin import`: scope exports, MATLAB files and bus logs into recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from drivetwin.cli.terminal import Quiet, terminal
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, refuse_to_replace
from drivetwin.recording.import_map import AxisMap, ImportMap, read_map
from drivetwin.recording.importer import import_recordings, ordered
from drivetwin.recording.recording import Recording, Samples
from drivetwin.recording.writer import write_into

SHOWN = 12
"""Recordings that the summary lists one by one; of more it shows the first and the last few."""


def import_command(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="CSV, MATLAB .mat, or a bus log (.log .asc .blf).")],
    map_: Annotated[Path, typer.Option("--map", metavar="MAP.yaml", help="The map of columns and units.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder: the recording, or one folder per file.")],
    repair: Annotated[
        bool,
        typer.Option("--repair", help="Remove repeated rows, fill in single missing samples, cut off ends without numbers."),
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Turn a drive's exports or a bus log into recordings.

    Example: drivetwin import scope.csv --map import.yaml --out out/scope

    FILE is a text table of any layout, a MATLAB file up to v7, or a log of candump -L, Vector ASC or BLF.

    MAP.yaml names columns, units, signs and the drive's constants: docs/import.md describes it, docs/examples/ has two
    working maps.

    With one FILE the folder DIR is the recording; with several each is DIR/NAME. Nothing is written unless every file is
    good.
    """
    refuse_to_replace(out, [*files, map_])
    import_map = read_map(map_)
    console = terminal(silent=quiet)
    recordings = _import(files, import_map, console, mend=repair)
    with new_directory(out) as staged:
        for recording in recordings:
            place = staged if len(recordings) == 1 else staged / recording.name
            write_into(recording, place, inputs=recording.files)
    console.print(summary(recordings, import_map))
    what = "1 recording" if len(recordings) == 1 else f"{len(recordings)} recordings, one folder each,"
    console.print(f"{what} in {out}", highlight=False, soft_wrap=True)


def _import(files: list[Path], import_map: ImportMap, console: Console, *, mend: bool) -> list[Recording]:
    if not files:
        raise UserError("no FILE to import; give at least one")
    if len(files) == 1:
        return import_recordings(files, import_map, mend=mend)
    columns = (
        TextColumn("importing"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[file]}"),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("import", total=len(files), file="")

        def done(file: Path) -> None:
            progress.update(task, advance=1, file=file.name)

        return import_recordings(files, import_map, mend=mend, done=done)


def summary(recordings: list[Recording], import_map: ImportMap) -> Table:
    """Samples, and least and most of each column."""
    table = Table(title=f"Machine {import_map.machine}")
    table.add_column("recording\naxis", overflow="fold")
    table.add_column("samples\nduration\nrate", justify="right", no_wrap=True)
    table.add_column("column", no_wrap=True)
    for name in ("least", "most"):
        table.add_column(name, justify="right", no_wrap=True)
    many = len(recordings) > SHOWN
    for number, recording in enumerate(recordings):
        if many and number == SHOWN // 2:
            table.add_row("...", f"{len(recordings) - SHOWN} more")
        if not many or number < SHOWN // 2 or number >= len(recordings) - SHOWN // 2:
            for axis, named in recording.columns.items():
                table.add_row(*_row(recording, axis, named, import_map.axes[axis]))
    return table


def _row(recording: Recording, axis: str, named: dict[str, Samples], entry: AxisMap) -> list[str]:
    names = ordered(named)
    period, samples = recording.info.sample_period, len(recording.time)
    labels = [f"{name} \\[{_unit(name, entry)}]" + _derived(recording, f"{axis}.{name}") for name in names]
    least = [f"{np.nanmin(named[name]):.4g}" for name in names]
    most = [f"{np.nanmax(named[name]):.4g}" for name in names]
    ranges = ["\n".join(lines) for lines in (labels, least, most)]
    return [f"{recording.name}\n{axis}", f"{samples}\n{samples * period:.4g} s\n{1 / period:.6g} Hz", *ranges]


def _derived(recording: Recording, column: str) -> str:
    return " (derived)" if column in recording.info.derived else ""


def _unit(column: str, entry: AxisMap) -> str:
    slide, column = entry.joint_type == "slide", column.removeprefix("joint_")
    if column.startswith("torque"):
        return "N" if slide else "N·m"
    if column.startswith("position"):
        return "m" if slide else "rad"
    if column.startswith("velocity"):
        return "m/s" if slide else "rad/s"
    return "degC"
