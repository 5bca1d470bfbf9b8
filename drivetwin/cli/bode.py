"""`drivetwin bode`: commission axes over the bus: frequency response, margins, gains, step response, torque over speed."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from drivetwin.bus.channel import INPROC
from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.on_machine import bar_progress, check_clock, join, log_kept, within_limits
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.controller.commissioning import Attempt, attempt_each
from drivetwin.controller.commissioning_file import responses_to_json
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import PACINGS
from drivetwin.controller.procedure import fitting
from drivetwin.controller.session import session_on
from drivetwin.drive_profiles import load_profile
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, refuse_foreign, refuse_to_replace, write_json
from drivetwin.identification.frequency.page import write_report
from drivetwin.identification.frequency.result import AxisResponse
from drivetwin.identification.frequency.wording import rows
from drivetwin.recording.writer import write_into

SOME_FAILED = 1
"""Exit status where an axis has no result and another one has."""


def bode_command(
    machine: Annotated[
        str, typer.Option(metavar="NAME|DIR|FILE.yaml", help="Machine: scara, stage, arm or one of your own.")
    ] = "scara",
    axis: Annotated[list[str] | None, typer.Option(help="Axis to commission; repeatable; default: all.")] = None,
    profile: Annotated[str, typer.Option(help="Drive type on the bus: servoone or cia402-full.")] = "servoone",
    bus: Annotated[str, typer.Option(help="inproc (emulates here), vcan0, can0, unix:PATH or ws://127.0.0.1:PORT.")] = INPROC,
    clock: Annotated[
        str, typer.Option(help="sync: as fast as possible, advanced by SYNC; realtime: 1 kHz on the wall clock.")
    ] = "sync",
    out: Annotated[Path, typer.Option(help="Directory for recordings, bode.json and report.html.")] = Path("out/bode"),
    truth: Annotated[
        Path | None, typer.Option(help="inproc only: true effects of the plant (effects/1); default: the machine's own.")
    ] = None,
    limits: Annotated[Path | None, typer.Option(help="Limits file (travel, speed, torque); required on can0.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before moving axes on can0.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the excitation, and inproc of the sensors' noise.")] = 0,
    effects_from: EffectsFrom = None,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Measure the frequency response of the velocity and position loop over the bus, and propose gains with margins.

    Brings up the drives, homes, and excites one axis after the other with a multisine torque (60B2h) while it travels slowly to
    and fro and the others hold. Then it steps the position and measures torque over speed. The report contains the mechanics,
    open and closed loops with coherence, phase and gain margin, resonances, and the proposed gains in the drive's own units.

    Example: drivetwin bode --machine stage --out out/bode

    The drives keep their parameters. Ctrl-C quick-stops and disables every axis. If the command fails, it does not write OUT;
    the bus log is OUT.failed.log. Exit status: 1 if some axes have no result, the others are then in OUT; 2 if no axis has one.
    """
    console = terminal(silent=quiet or json_)
    check_clock(clock, bus)
    use_effects(effects_from)
    known, allowed = within_limits(load_machine(machine), limits, bus, yes)
    known.check_axes(axis or ())
    axes = axis or list(known.axes)
    drive_type = load_profile(profile)
    refuse_foreign(out)
    refuse_to_replace(out, [file for file in (limits, truth) if file is not None])
    joined = join(bus, machine, drive_type, clock, truth, seed)
    streaming = fitting(len(known.axes))
    with (
        bar_progress(console) as progress,
        new_directory(out) as staged,
        log_kept(staged / "bus.log", out.absolute()),
    ):
        with session_on(
            joined.bus, known, drive_type, PACINGS[clock](), allowed, progress, staged / "bus.log", streaming
        ) as session:
            attempts = list(attempt_each(session, axes, seed))
            told = responses_to_json(attempts, session, seed)
        found = [each.found for each in attempts if each.found is not None]
        failures = [each.failure for each in attempts if each.failure]
        if not found:
            raise UserError("; ".join(failures))
        _write(attempts, found, told, staged, seed)
    _print(console, found, out)
    if json_:
        print((out / "bode.json").read_text(encoding="utf-8"), end="")
    for failure in failures:
        print(f"drivetwin: {failure}", file=sys.stderr)
    if failures:
        raise typer.Exit(SOME_FAILED)


def _write(attempts: list[Attempt], found: list[AxisResponse], told: dict[str, object], staged: Path, seed: int) -> None:
    """Recordings, also of axes that tell nothing, bode.json and report.html."""
    for each in attempts:
        for recording in each.measured.recordings:
            write_into(recording, staged / "recordings" / recording.name, seed=seed, inputs=[])
    write_json(staged / "bode.json", told)
    write_report(found, told, staged / "report.html")


def _print(console: Console, found: list[AxisResponse], out: Path) -> None:
    for each in found:
        table = Table(title=f"Axis {each.axis}", title_justify="left", box=box.SIMPLE_HEAD)
        for name in ("", "now", "proposed"):
            table.add_column(name, no_wrap=True, justify="right" if name else "left")
        for row in rows(each):
            table.add_row(row.quantity, row.now, row.proposed)
        console.print(table)
        if each.proposal is None:
            console.print(f"{each.axis}: no gains that were tried keep the margins: there is no proposal", highlight=False)
    console.print(f"{out / 'report.html'}  {out / 'bode.json'}  {out / 'bus.log'}", highlight=False, soft_wrap=True)
