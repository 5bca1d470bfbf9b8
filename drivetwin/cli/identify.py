"""`drivetwin identify`: bring up the drives, move the axes, capture torque, hand back the friction."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from drivetwin.bus.channel import INPROC
from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.identify_summary import print_summary
from drivetwin.cli.live import AsLive, live
from drivetwin.cli.on_machine import bar_progress, check_clock, emulated_apart, join, log_kept, within_limits
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import PACINGS
from drivetwin.controller.procedure import FIT, Captured, capture_machine
from drivetwin.controller.sdo_check import to_json
from drivetwin.drive_profiles import load_profile
from drivetwin.foundation.files import new_directory, refuse_foreign, refuse_to_replace, write_json
from drivetwin.foundation.machine_picture import machine_picture
from drivetwin.identification import identify, load_model, write_results
from drivetwin.identification.wording import headline
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_into


def identify_command(
    machine: Annotated[
        str, typer.Option(metavar="NAME|DIR|FILE.yaml", help="Machine: scara, stage, arm or one of your own.")
    ] = "scara",
    profile: Annotated[str, typer.Option(help="Drive type on the bus: servoone or cia402-full.")] = "servoone",
    bus: Annotated[str, typer.Option(help="inproc (emulates here), vcan0, can0, unix:PATH or ws://127.0.0.1:PORT.")] = INPROC,
    clock: Annotated[
        str, typer.Option(help="sync: as fast as possible, advanced by SYNC; realtime: 1 kHz on the wall clock.")
    ] = "sync",
    out: Annotated[Path, typer.Option(help="Directory for recordings, identified.json, report.html and plots.")] = Path(
        "out/identify"
    ),
    truth: Annotated[
        Path | None, typer.Option(help="inproc only: true effects of the plant (effects/1); default: the machine's own.")
    ] = None,
    limits: Annotated[Path | None, typer.Option(help="Limits file (travel, speed, torque); required on can0.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before moving axes on can0.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the excitation move, and inproc of the sensors' noise.")] = 0,
    effects_from: EffectsFrom = None,
    as_live: AsLive = False,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Identify the friction of every axis over the bus.

    Brings up the drives, homes, streams strokes and an excitation move, captures torque by PDO and SDO at 1 kHz, and fits
    inertia, Coulomb and viscous friction and the Stribeck curve by least squares, with 90 % intervals.

    Example: drivetwin identify --machine scara --bus ws://127.0.0.1:54701 --clock realtime --out out/identify

    Ctrl-C quick-stops and disables every axis. If it fails, OUT is not written; the bus log is OUT.failed.log.
    """
    console = terminal(silent=quiet or json_)
    check_clock(clock, bus)
    use_effects(effects_from)
    known, allowed = within_limits(load_machine(machine), limits, bus, yes)
    drive_type = load_profile(profile)
    refuse_foreign(out)
    refuse_to_replace(out, [file for file in (limits, truth) if file is not None])
    with ExitStack() as ends:
        if as_live and bus == INPROC:
            joined, emulated = ends.enter_context(emulated_apart(machine, profile, clock, truth, seed))
            seen = ["--bus", emulated.bus, "--control", str(emulated.control)]
        else:
            joined = join(bus, machine, drive_type, clock, truth, seed)
            seen = ["--bus", bus]
        seen += ["--machine", machine, "--profile", profile, "--clock", clock]
        telling = ends.enter_context(live(as_live, f"identify {known.machine}", seen))
        with (
            bar_progress(console, telling) as progress,
            new_directory(out) as staged,
            log_kept(staged / "bus.log", out.absolute()),
        ):
            log = staged / "bus.log"
            captured = capture_machine(joined.bus, known, drive_type, PACINGS[clock](), allowed, seed, progress, log)
            progress.phase("fit and report", 1.0)
            inputs = [known.model_path, known.axes_path, *([limits] if limits is not None else [])]
            fitted, held = _write_recordings(staged, captured, seed, inputs)
            found = identify(load_model(known.model_path), fitted, held, FIT)
            told = joined.truth()  # only now: the fit is made
            title = f"{known.machine}: identification over the bus"
            picture = machine_picture(read_mjcf(known.model_path), {result.joint for result in found.axes.values()})
            write_results(found, [*fitted, *held], staged, truth=told, seed=seed, title=title, picture=picture, inputs=inputs)
            write_json(staged / "torque_by_sdo.json", to_json(captured.sdo_points, seed, inputs))
            progress.finish()
        print_summary(console, found, told, captured, out)
        if json_:
            print((out / "identified.json").read_text(encoding="utf-8"), end="", flush=True)
        telling.done(headline(found, told or {}) or f"Identified: {', '.join(found.axes)}.", out / "report.html")


def _write_recordings(
    staged: Path, captured: Captured, seed: int, inputs: Sequence[Path]
) -> tuple[list[Recording], list[Recording]]:
    """Write every recording below the staged directory; those to fit and those to validate on, which know their files."""

    def write(recording: Recording) -> Recording:
        folder = staged / "recordings" / recording.name
        write_into(recording, folder, seed=seed, inputs=inputs)
        return replace(recording, source=folder, files=(folder / "recording.json", folder / "signals.parquet"))

    return [write(recording) for recording in captured.recordings], [write(recording) for recording in captured.validation]
