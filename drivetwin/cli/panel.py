"""`drivetwin panel`: a front panel in the browser, for drives on a bus or for a machine that it emulates."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from drivetwin.bus.channel import is_physical, open_bus
from drivetwin.cli.waiting import ITS_START, waiting
from drivetwin.controller.machine import Axis as MachineAxis
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import PACINGS
from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.emulator.machine import load_machine as load_plant
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.priority import give_way
from drivetwin.foundation.scratch import scratch
from drivetwin.panel.access import Access, Pen, is_loopback
from drivetwin.panel.bus_panel import BusPanel
from drivetwin.panel.commissioning import Commissioning
from drivetwin.panel.emulated import Emulated
from drivetwin.panel.link import Link
from drivetwin.panel.motion import Motion, Program
from drivetwin.panel.node_watch import Axis
from drivetwin.panel.panel import Panel, find_nodes
from drivetwin.panel.run import RunWatch
from drivetwin.panel.run_panel import RunPanel
from drivetwin.panel.server import listen, serve

ANSWER = 60.0
"""Longest that the host of a bus may take to let the panel in [s]."""

MACHINE = "scara"
"""What is emulated where nothing is said."""


def panel_command(
    emulate: Annotated[
        str | None, typer.Option(metavar="MACHINE", help="Emulate this machine and move it; default without --bus: scara.")
    ] = None,
    bus: Annotated[
        str | None,
        typer.Option(help="Join this bus; with --emulate, the bus of the machine: vcan0, unix:PATH, ws://127.0.0.1:PORT."),
    ] = None,
    profile: Annotated[str, typer.Option(help="Drive type: servoone, cia402-full or dryve_d1.")] = "servoone",
    eds: Annotated[Path | None, typer.Option(help="A drive's own EDS or DCF; replaces the profile's objects.")] = None,
    machine: Annotated[
        str | None,
        typer.Option(metavar="NAME|DIR|FILE.yaml", help="With --bus: the machine on it; names and draws its axes."),
    ] = None,
    control: Annotated[
        Path | None,
        typer.Option(metavar="PATH", help="With --bus: control socket of the emulator on it, for faults and truth."),
    ] = None,
    clock: Annotated[
        str, typer.Option(help="With --bus, the clock of its machine: sync (SYNC advances time) or realtime.")
    ] = "realtime",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page; 0: a free one.")] = 8402,
    host: Annotated[
        str, typer.Option(help="Address of the page; if other computers can reach it, the printed token is required.")
    ] = "127.0.0.1",
    allow_writes: Annotated[
        bool, typer.Option("--allow-writes", help="Let one page at a time write, command and inject faults.")
    ] = False,
    run: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Show the command that writes run.json (run/1) to this folder, with --bus or alone."),
    ] = None,
) -> None:
    """Look at drives in the browser: states, parameters, faults. Without a bus it starts the SCARA in motion.

    Example: drivetwin panel

    Prints the address of the page. Without --allow-writes the panel only reads. Ctrl-C ends it, and everything it started.
    """
    if clock not in PACINGS:
        raise UserError(f"unknown clock {clock!r}; expected {' or '.join(PACINGS)}")
    drive_type = load_profile(profile) if eds is None else profile_from_eds(eds, load_profile(profile))
    token = None if is_loopback(host) else secrets.token_urlsafe(16)
    access, pen = Access(host, token), Pen(allowed=allow_writes)
    shown = None if run is None else RunWatch(run)
    if shown is not None and bus is None and emulate is None:
        with listen(host, port) as where:
            print(f"panel on {_address(access, where.getsockname()[1])}. Ctrl-C ends.", flush=True)
            serve(RunPanel(shown), access, where)
        return
    with listen(host, port) as where, _seen(emulate, bus, profile, machine, control) as seen, _joined_by(seen.bus) as link:
        with waiting(f"drives to be heard on {seen.bus}"):
            node_ids = sorted(seen.axes) or find_nodes(link)
        with Panel(
            link, node_ids, drive_type, seen.axes, pen, seen.motion, seen.control, seen.machine, seen.model, seen.commissioning,
            paced=seen.motion is not None or clock == "sync",
        ) as panel:  # fmt: skip
            if seen.motion is not None:
                seen.motion.start()
            print(_joinable(panel, access, where.getsockname()[1]), flush=True)
            serve(BusPanel(panel, shown), access, where)


@dataclass(frozen=True)
class _Seen:
    """What the panel looks at: a bus, its axes by node-ID where they are known, and what moves them."""

    bus: str
    axes: dict[int, Axis]
    motion: Motion | None
    control: Path | None = None
    machine: str | None = None
    model: Path | None = None
    commissioning: Commissioning | None = None


@contextmanager
def _seen(emulate: str | None, bus: str | None, profile: str, known: str | None, control: Path | None) -> Iterator[_Seen]:
    """A bus to join, or a machine that is emulated meanwhile and moves, until it is stopped at the end."""
    if (known is not None or control is not None) and (bus is None or emulate is not None):
        raise UserError("--machine and --control describe a bus that is joined: give --bus, and no --emulate")
    if bus is not None and emulate is None:
        give_way()  # before there is a thread: each has a priority of its own
        yield _joined(bus, known, control)
        return
    if bus is not None and is_physical(bus):
        raise UserError(f"{bus} may be a real bus with a real machine; leave --emulate out to look at it")
    machine = emulate or MACHINE
    described = load_machine(machine)
    with ExitStack() as ends:
        folder = ends.enter_context(scratch())
        with waiting(f"the emulator of {machine}: {ITS_START}"):
            emulated = Emulated(machine, profile, bus, folder)
        ends.callback(emulated.stop)
        motion = Motion(emulated.bus, machine, profile, folder)
        ends.callback(motion.stop)
        axes = {emulated.nodes[name]: _axis(name, axis) for name, axis in described.axes.items()}
        program = Program(emulated.bus, machine, profile, folder, "bode", 0.001, "sync")
        ends.callback(program.stop)
        desk = Commissioning(program, motion, tuple(described.axes))
        yield _Seen(emulated.bus, axes, motion, emulated.control, machine, load_plant(machine).model_path, desk)


@contextmanager
def _joined_by(bus: str) -> Iterator[Link]:
    """The panel's end of a bus."""
    with waiting(f"an answer of {bus}: does its host run, or was it stopped?", ANSWER):
        opened = open_bus(bus)
    with Link(opened) as link:
        yield link


def _joined(bus: str, machine: str | None, control: Path | None) -> _Seen:
    """A bus of somebody else, with what is known of it."""
    if machine is None:
        return _Seen(bus, {}, None, control)
    described = load_machine(machine)
    axes = {axis.node_id: _axis(name, axis) for name, axis in described.axes.items()}
    return _Seen(bus, axes, None, control, machine, described.model_path)


def _axis(name: str, axis: MachineAxis) -> Axis:
    return Axis(name, axis.joint, axis.gear_ratio, "m" if axis.prismatic else "rad")


def _joinable(panel: Panel, access: Access, port: int) -> str:
    """The line that says where the page is, and what it may."""
    nodes = ", ".join(f"{node.node_id} {node.name}" for node in panel.nodes.values())
    may = "may write" if panel.pen.allowed else "reads only (--allow-writes)"
    return f"panel on {_address(access, port)}: nodes {nodes}, on {panel.link.name}; {may}. Ctrl-C ends."


def _address(access: Access, port: int) -> str:
    """Where the page is, with the token that others need."""
    host = f"[{access.host}]" if ":" in access.host else access.host
    return f"http://{host}:{port}/" + (f"?token={access.token}" if access.token else "")
