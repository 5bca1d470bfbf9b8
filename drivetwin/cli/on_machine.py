"""What the commands that move a machine share: the bus and who tells the truth, limits, the log that is kept, bars."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import can
import typer
from rich.console import Console
from rich.progress import BarColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars

from drivetwin.bus.channel import INPROC, InprocBus, is_physical, open_bus
from drivetwin.cli.live import SILENT, Live
from drivetwin.cli.terminal import terminal
from drivetwin.cli.waiting import ITS_START, waiting
from drivetwin.controller.limits import Limits, read_limits, within
from drivetwin.controller.machine import Machine
from drivetwin.controller.pacing import PACINGS
from drivetwin.controller.progress import Progress
from drivetwin.drive_profiles import DriveProfile
from drivetwin.emulator.clock import CLOCKS
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import truth_path
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.control_socket import ask_control
from drivetwin.foundation.errors import InterruptedByUserError, UserError
from drivetwin.foundation.scratch import scratch
from drivetwin.identification.result import Truth
from drivetwin.panel.emulated import Emulated


def check_clock(clock: str, bus: str) -> None:
    """Raise UserError for a clock that there is not, or that a real machine cannot have."""
    if clock not in PACINGS:
        raise UserError(f"unknown clock {clock!r}; expected {' or '.join(PACINGS)}")
    if is_physical(bus) and clock != "realtime":
        raise UserError(f"{bus} may be a real machine, whose drives have their own clock: give --clock realtime")


@contextmanager
def log_kept(log: Path, out: Path) -> Iterator[None]:
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
class Joined:
    """The bus as the controller sees it, and who can tell the truth after the fit."""

    bus: can.BusABC
    truth: Callable[[], Truth | None]


def join(bus: str, machine: str, profile: DriveProfile, clock: str, truth: Path | None, seed: int) -> Joined:
    """Join the named bus; for inproc build the emulator on its other end."""
    if bus != INPROC:
        if truth is not None:
            raise UserError("--truth is for the emulator: give it to `drivetwin emulate`, not to a controller on another bus")
        return Joined(open_bus(bus), lambda: None)
    virtual = load_virtual_machine(machine)
    effects = read_effects(truth_path(virtual, truth))
    built: list[VirtualMachine] = []

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        built.append(VirtualMachine(virtual, profile, effects, CLOCKS[clock](), seed, transmit))
        built[0].power_on()
        return built[0]

    bus_here = InprocBus(connect)
    return Joined(bus_here, built[0].plant.truth)


@contextmanager
def emulated_apart(machine: str, profile: str, clock: str, truth: Path | None, seed: int) -> Iterator[tuple[Joined, Emulated]]:
    """The machine as a process of its own, on a bus that a panel can join too."""
    more = ["--clock", clock, "--seed", str(seed), *(() if truth is None else ("--truth", str(truth)))]
    with scratch() as folder:
        with waiting(f"the emulator of {machine}: {ITS_START}"):
            emulated = Emulated(machine, profile, None, folder, more)
        try:
            yield Joined(open_bus(emulated.bus), lambda: ask_control(emulated.control, {"parameters": {}})["axes"]), emulated
        finally:
            emulated.stop()


def within_limits(machine: Machine, path: Path | None, bus: str, yes: bool) -> tuple[Machine, Limits | None]:
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


class BarProgress(Progress):
    """A bar a phase, on the terminal and for whoever is told."""

    def __init__(self, bars: Bars, telling: Live) -> None:
        self._bars = bars
        self._telling = telling
        self._task: TaskID | None = None

    def phase(self, name: str, seconds: float) -> None:
        self.finish()
        self._task = self._bars.add_task(name, total=seconds)
        self._telling.phase(name)

    def advance(self, seconds: float) -> None:
        if self._task is not None:
            self._bars.advance(self._task, seconds)
            self._telling.advance(self._bars.tasks[self._task].percentage / 100.0)

    def finish(self) -> None:
        """Fill the bar of the phase that has ended."""
        if self._task is not None:
            total = self._bars.tasks[self._task].total
            self._bars.update(self._task, completed=total)


@contextmanager
def bar_progress(console: Console, telling: Live = SILENT) -> Iterator[BarProgress]:
    """Bars on `console`, and what is told, while the block runs."""
    columns = (TextColumn("{task.description:<34}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"), TimeElapsedColumn())
    with Bars(*columns, console=console) as bars:
        yield BarProgress(bars, telling)
