"""`drivetwin identify`: bring up the drives, move the axes, capture torque, hand back the friction."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import can
import typer
from rich.progress import BarColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars

from drivetwin.bus.channel import INPROC, InprocBus, is_physical, open_bus
from drivetwin.cli.effects_from import EffectsFrom, use_effects
from drivetwin.cli.identify_summary import print_summary
from drivetwin.cli.terminal import AsJson, Quiet, terminal
from drivetwin.controller.limits import Limits, read_limits, within
from drivetwin.controller.machine import Machine, load_machine
from drivetwin.controller.pacing import PACINGS
from drivetwin.controller.procedure import FIT, Captured, capture_machine
from drivetwin.controller.progress import Progress
from drivetwin.controller.sdo_check import to_json
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.emulator.clock import CLOCKS
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import truth_path
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import InterruptedByUserError, UserError
from drivetwin.foundation.files import new_directory, refuse_foreign, refuse_to_replace, write_json
from drivetwin.foundation.machine_picture import machine_picture
from drivetwin.identification import identify, load_model, write_results
from drivetwin.identification.result import Truth
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_into

logger = logging.getLogger(__name__)


def identify_command(
    machine: Annotated[
        str, typer.Option(metavar="NAME|DIR|FILE.yaml", help="Machine: scara, stage, arm or one of your own.")
    ] = "scara",
    profile: Annotated[str, typer.Option(help="Drive type on the bus: servoone or cia402-full.")] = "servoone",
    bus: Annotated[str, typer.Option(help="inproc (starts the emulator here), vcan0, can0 or ws://127.0.0.1:PORT.")] = INPROC,
    clock: Annotated[
        str, typer.Option(help="sync: as fast as it goes, moved by SYNC; realtime: 1 kHz on the wall clock.")
    ] = "sync",
    out: Annotated[Path, typer.Option(help="Directory for recordings, identified.json, report.html and plots.")] = Path(
        "out/identify"
    ),
    truth: Annotated[
        Path | None, typer.Option(help="inproc only: true effects of the plant (effects/1); default: the machine's own.")
    ] = None,
    limits: Annotated[Path | None, typer.Option(help="Limits file (travel, speed, torque); required on can0.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before moving axes on can0.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the exciting move, and inproc of the sensors' noise.")] = 0,
    effects_from: EffectsFrom = None,
    quiet: Quiet = False,
    json_: AsJson = False,
) -> None:
    """Identify the friction of every axis over the bus.

    Brings up the drives, homes, streams strokes and an exciting move, captures torque by PDO and SDO at 1 kHz, and fits
    inertia, Coulomb and viscous friction and the Stribeck curve by least squares, with 90 % intervals.

    Example: drivetwin identify --machine scara --bus ws://127.0.0.1:54701 --clock realtime --out out/identify

    Ctrl-C quick-stops and disables every axis. Where it fails, OUT is not written; the bus log until then is OUT.failed.log.
    """
    console = terminal(silent=quiet or json_)
    if clock not in PACINGS:
        raise UserError(f"unknown clock {clock!r}; expected {' or '.join(PACINGS)}")
    if is_physical(bus) and clock != "realtime":
        raise UserError(f"{bus} may be a real machine, whose drives keep time by themselves: give --clock realtime")
    use_effects(effects_from)
    known, allowed = _within_limits(load_machine(machine), limits, bus, yes)
    drive_type = load_profile(profile)
    refuse_foreign(out)
    refuse_to_replace(out, [file for file in (limits, truth) if file is not None])
    joined = _join(bus, machine, drive_type, clock, truth, seed)
    with Bars(
        TextColumn("{task.description:<34}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        console=console,
    ) as bars:
        progress = _RichProgress(bars)
        with new_directory(out) as staged, _log_kept(staged / "bus.log", out.absolute()):
            captured = capture_machine(
                joined.bus, known, drive_type, PACINGS[clock](), allowed, seed, progress, staged / "bus.log"
            )
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
        print((out / "identified.json").read_text(encoding="utf-8"), end="")


@contextmanager
def _log_kept(log: Path, out: Path) -> Iterator[None]:
    """Where the block fails, the frames until then stay beside `out`, which is not written then: the trouble is in them.

    Raises UserError, which says where, in the place of what failed; Ctrl-C is no failure.
    """
    try:
        yield
    except InterruptedByUserError:
        raise
    except (UserError, can.CanError) as error:
        if not log.is_file():
            raise
        kept = log.replace(out.with_name(f"{out.name}.failed.log"))
        raise UserError(f"{error}; the bus log until then: {kept}") from error


@dataclass(frozen=True)
class _Joined:
    """The bus as the controller sees it, and who can tell the truth after the fit."""

    bus: can.BusABC
    truth: Callable[[], Truth | None]


def _join(bus: str, machine: str, profile: DriveProfile, clock: str, truth: Path | None, seed: int) -> _Joined:
    """Join the named bus; for inproc build the emulator on its other end."""
    if bus != INPROC:
        if truth is not None:
            raise UserError("--truth is for the emulator: give it to `drivetwin emulate`, not to a controller on another bus")
        return _Joined(open_bus(bus), lambda: None)
    virtual = load_virtual_machine(machine)
    effects = read_effects(truth_path(virtual, truth))
    built: list[VirtualMachine] = []

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        built.append(VirtualMachine(virtual, profile, effects, CLOCKS[clock](), seed, transmit))
        built[0].power_on()
        return built[0]

    bus_here = InprocBus(connect)
    return _Joined(bus_here, built[0].plant.truth)


def _within_limits(machine: Machine, path: Path | None, bus: str, yes: bool) -> tuple[Machine, Limits | None]:
    """The machine narrowed to its limits file; a bus that may be physical needs the file and a confirmation."""
    if path is None:
        if is_physical(bus):
            raise UserError(
                f"{bus} may be a real machine: give --limits FILE with travel, speed and torque of {', '.join(machine.axes)}"
            )
        return machine, None
    limits = read_limits(path, machine)
    if is_physical(bus) and not yes:
        for name, limit in limits.axes.items():
            terminal().print(
                f"{name}: travel {limit.travel}, speed {limit.speed}, torque {limit.torque} (joint, SI)", highlight=False
            )
        if not typer.confirm(f"Axes on {bus} will move. Is the machine clear?"):
            raise UserError("not confirmed; nothing was moved")
    return within(machine, limits), limits


def _write_recordings(
    staged: Path, captured: Captured, seed: int, inputs: Sequence[Path]
) -> tuple[list[Recording], list[Recording]]:
    """Write every recording below the staged directory; those to fit and those to validate on, which know their files."""

    def write(recording: Recording) -> Recording:
        folder = staged / "recordings" / recording.name
        write_into(recording, folder, seed=seed, inputs=inputs)
        return replace(recording, source=folder, files=(folder / "recording.json", folder / "signals.parquet"))

    return [write(recording) for recording in captured.recordings], [write(recording) for recording in captured.validation]


class _RichProgress(Progress):
    """A bar a phase."""

    def __init__(self, bars: Bars) -> None:
        self._bars = bars
        self._task: TaskID | None = None

    def phase(self, name: str, seconds: float) -> None:
        self.finish()
        self._task = self._bars.add_task(name, total=seconds)

    def advance(self, seconds: float) -> None:
        if self._task is not None:
            self._bars.advance(self._task, seconds)

    def finish(self) -> None:
        """Fill the bar of the phase that has ended."""
        if self._task is not None:
            total = self._bars.tasks[self._task].total
            self._bars.update(self._task, completed=total)
