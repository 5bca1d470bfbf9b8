"""`drivetwin emulate`: virtual drives on a bus for other processes to command."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Annotated

import can
import typer

from drivetwin.bus.channel import host_bus
from drivetwin.bus.timing.bit_rate import read_bit_rate
from drivetwin.cli.effects_from import EffectsFrom, say_what_lies_beside, use_effects
from drivetwin.cli.ended import ended_by_signals
from drivetwin.cli.panel_beside import panel_beside
from drivetwin.cli.terminal import AsJson
from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.snapshot import read_snapshot
from drivetwin.emulator.backlog import Backlog
from drivetwin.emulator.canopen.lss import UNCONFIGURED
from drivetwin.emulator.clock import CLOCKS
from drivetwin.emulator.composition import composed
from drivetwin.emulator.control import serve_control
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.modbus import serve_modbus
from drivetwin.emulator.plant import Plant, truth_path
from drivetwin.emulator.snapshot import load_snapshot
from drivetwin.emulator.timed_bus import TIMED_BUSES, TimedBus
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.collector import keep_for_good
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.priority import real_time
from drivetwin.foundation.scratch import scratch

POLL = 0.2
"""How long to wait for a frame before looking whether to stop [s], where only SYNC moves time."""


def emulate_command(
    machine: Annotated[
        str, typer.Option(metavar="NAME|DIR|FILE.yaml", help="Machine: scara, stage, arm or one of your own.")
    ] = "scara",
    profile: Annotated[str, typer.Option(help="Drive type: servoone, cia402-full or dryve_d1.")] = "servoone",
    bus: Annotated[str, typer.Option(help="vcan0, can0, unix:PATH or ws://127.0.0.1:PORT (0: a free one).")] = "ws://127.0.0.1:54701",
    clock: Annotated[str, typer.Option(help="realtime follows the wall clock; sync advances only with SYNC.")] = "realtime",
    truth: Annotated[
        Path | None, typer.Option(help="True effects of the plant (effects/1); replaces all of the machine's own.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="MODEL.xml", help="MuJoCo model (MJCF); replaces the machine's own.")
    ] = None,
    effects: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Effects (effects/1) to add to the machine's own.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sensors' noise.")] = 0,
    store: Annotated[
        Path | None, typer.Option(help="Directory in which the drives keep stored parameters (1010h) between runs.")
    ] = None,
    modbus: Annotated[
        str | None, typer.Option(help="Also serve Modbus TCP, at HOST:PORT or PORT of 127.0.0.1 (port 0: a free one).")
    ] = None,
    modbus_serial: Annotated[
        str | None, typer.Option(help="Also serve Modbus RTU, on DEVICE[,BAUD[,PARITY]]; default 19200,E.")
    ] = None,
    eds: Annotated[Path | None, typer.Option(help="A drive's own EDS or DCF: its objects replace the profile's.")] = None,
    snapshot: Annotated[
        list[Path] | None, typer.Option(help="File of `drivetwin snapshot`; loaded into the node that it names.")
    ] = None,
    bit_rate: Annotated[
        str | None, typer.Option(help="Model bit timing at 1M, 500k, 250k or 125k: frames take time, queue and arrive late.")
    ] = None,
    control: Annotated[
        Path | None, typer.Option(metavar="PATH", help="Unix socket on which `drivetwin fault` injects faults.")
    ] = None,
    panel: Annotated[
        bool, typer.Option("--panel", help="Also serve a front panel in the browser, on a free port; it only reads.")
    ] = False,
    effects_from: EffectsFrom = None,
    json_: AsJson = False,
) -> None:
    """Put a virtual machine's drives on a bus and let any master command them.

    Example: drivetwin emulate --machine scara --profile servoone --bus ws://127.0.0.1:54701

    Prints one line when others can join, with the bus and the priority at which --clock realtime runs. Nodes have the IDs of
    the machine's file (scara: 1 lift, 2 rotate, 3 stretch), or those stored by LSS. Ctrl-C ends it.

    With your own model (same joints): drivetwin emulate --machine stage --model twin.xml --effects twin.effects.json. Added
    effects act in addition to the machine's own friction, or replace it where both give the same quantity; a line says so.
    """
    if clock not in CLOCKS:
        raise UserError(f"unknown clock {clock!r}; expected {' or '.join(CLOCKS)}")
    use_effects(effects_from)
    chosen = load_machine(machine)
    joints = {name: axis.joint for name, axis in chosen.axes.items()}
    if model is not None:
        say_what_lies_beside(model, effects)
    acting = composed(read_effects(truth_path(chosen, truth)), read_effects(effects) if effects else (), model, joints)
    drive_type = load_profile(profile) if eds is None else profile_from_eds(eds, load_profile(profile))
    rate = None if bit_rate is None else read_bit_rate(bit_rate)

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        plant = Plant(chosen, acting.effects, model)
        return VirtualMachine(chosen, drive_type, acting.effects, CLOCKS[clock](), seed, transmit, store, plant)

    for line in acting.gave_way:
        print(f"drivetwin: {line}", file=sys.stderr)
    hosted = host_bus(bus)
    try:
        joined = connect(hosted.bus.send) if rate is None else TIMED_BUSES[clock](rate, connect, hosted.bus.send)
        virtual = joined.virtual if isinstance(joined, TimedBus) else joined
        for file in snapshot or ():
            load_snapshot(virtual.drives, read_snapshot(file), file)
        nodes = {name: drive.device.node_id for drive, name in zip(virtual.drives, chosen.axes, strict=True)}
        ended = ended_by_signals()
        with (
            serve_modbus(virtual, modbus, modbus_serial) as ports,
            _control_path(control, panel) as door,
            serve_control(virtual, door),
            real_time() if clock == "realtime" else nullcontext() as priority,
        ):
            where = (hosted.name, *ports, *(() if control is None else (f"control on {control}",)))
            print(_joinable(chosen.machine, profile, nodes, where, clock, priority, as_json=json_), flush=True)
            joined.power_on()
            keep_for_good()
            with _panel(hosted.name, machine, profile, clock, eds, door) if panel else nullcontext():
                serve(joined, hosted.bus, ended)
    finally:
        hosted.close()


def _joinable(
    machine: str,
    profile: str,
    nodes: Mapping[str, int],
    where: Sequence[str],
    clock: str,
    priority: str | None,
    *,
    as_json: bool,
) -> str:
    """The line that says that others can join; of JSON one line as well."""
    if as_json:
        configured = {axis: None if node_id == UNCONFIGURED else node_id for axis, node_id in nodes.items()}
        told = {"machine": machine, "profile": profile, "nodes": configured, "on": where, "clock": clock, "priority": priority}
        return json.dumps(told)
    named = ", ".join(_node(node_id, axis) for axis, node_id in nodes.items())
    paced = f"clock {clock}" if priority is None else f"clock {clock} {priority}"
    return f"{machine}: {profile} drives, nodes {named}, on {', '.join(where)}, {paced}. Ctrl-C ends."


def _node(node_id: int, axis: str) -> str:
    return f"{axis} without node-ID" if node_id == UNCONFIGURED else f"{node_id} {axis}"


@contextmanager
def _control_path(told: Path | None, panel: bool) -> Iterator[Path | None]:
    """Where the control socket is; a panel gets one of its own, so that it takes no turn on a drive's one SDO channel."""
    if told is not None or not panel:
        yield told
        return
    with scratch() as folder:
        yield folder / "control"


def _panel(
    bus: str, machine: str, profile: str, clock: str, eds: Path | None, control: Path | None
) -> AbstractContextManager[None]:
    """`drivetwin panel` on this bus."""
    paths = [str(word) for name, path in (("--eds", eds), ("--control", control)) if path is not None for word in (name, path)]
    return panel_beside(["--bus", bus, "--machine", machine, "--profile", profile, "--clock", clock, *paths])


def serve(
    joined: VirtualMachine | TimedBus,
    bus: can.BusABC,
    ended: threading.Event,
    now: Callable[[], float] = time.monotonic,
) -> None:
    """Hand each frame of a bus to a machine and let its time pass, until `ended`; `now` is the wall clock [s]."""
    backlog = Backlog(now)
    while not ended.is_set():
        message = bus.recv(0.0)
        joined.hurry(backlog.hurries(message is not None))
        if message is None:
            pause = joined.wait()
            message = bus.recv(POLL if pause is None else pause)
        if message is not None:
            joined.receive(message)
        joined.poll()
