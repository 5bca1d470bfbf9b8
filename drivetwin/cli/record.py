"""`drivetwin record`: what any master and any drives say on a bus, as a recording."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from drivetwin.bus.channel import open_bus
from drivetwin.bus.listening import Listener
from drivetwin.cli.ended import ended_by_signals
from drivetwin.cli.import_ import summary
from drivetwin.cli.on_machine import log_kept
from drivetwin.cli.terminal import Quiet, terminal
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_directory, refuse_foreign, refuse_to_replace
from drivetwin.recording.formats.bus_log import read_bus_log
from drivetwin.recording.import_map import AxisMap, BusLayout, ColumnMap, ImportMap, read_map
from drivetwin.recording.importer import import_recording
from drivetwin.recording.mcap_file import write_mcap
from drivetwin.recording.recording import Recording, Samples
from drivetwin.recording.writer import write_into

LOG = "bus.log"
MCAP = "recording.mcap"
STATUSWORD = "statusword"
DEMANDS = ((0x60C1, 1), (0x607A, 0), (0x6062, 0))
"""Where a demand may stand, in the order in which it is looked for: interpolated, target, demand value (CiA 402-2)."""


def record_command(
    bus: Annotated[str, typer.Option(help="can0, vcan0, unix:PATH or ws://127.0.0.1:PORT: a bus with any master and drives.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder: the recording, and the log as bus.log.")],
    *,
    map_: Annotated[
        Path | None, typer.Option("--map", metavar="MAP.yaml", help="Defines which object is which column (docs/import.md).")
    ] = None,
    eds: Annotated[
        Path | None, typer.Option(metavar="FILE", help="EDS or DCF of the drives; without a map, 6064h and 6077h are recorded.")
    ] = None,
    node: Annotated[
        list[int] | None, typer.Option(metavar="ID", min=1, max=127, help="With --eds alone: a node-ID; repeatable.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", min=0.0, help="Stop after this time; default: until Ctrl-C.")
    ] = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Each SYNC is one cycle, whenever it comes: drives of `emulate --clock sync`.")
    ] = False,
    mcap: Annotated[
        bool, typer.Option("--mcap", help="Also write recording.mcap, for Foxglove and Rerun (needs the extra `formats`).")
    ] = False,
    no_ask: Annotated[
        bool, typer.Option("--no-ask", help="Send nothing: take scales and mapping from log, map and DCF.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Record any drives that any master moves, by listening to their bus.

    Example: drivetwin record --bus can0 --map drives.yaml --seconds 60 --out out/monday

    At the start it reads from each drive, by SDO, encoder (608Fh), gear (6091h), feed (6092h), rated torque (6076h) and the PDO
    mapping, but never while a master uses the drive's SDO channel. It sends nothing else. If a master changes one of these
    later, the log has the new value. A default in an EDS that neither confirms is not used as a scale.
    """
    import_map = _map(map_, eds, node, lockstep)
    if mcap:
        import_module("mcap.writer")  # missing, it is said before anything is recorded
    refuse_foreign(out)
    refuse_to_replace(out, [path for path in (map_, eds) if path is not None])
    console = terminal(silent=quiet)
    ended = ended_by_signals()
    with new_directory(out) as staged:
        log = staged / LOG
        with log_kept(log, out):
            joined = open_bus(bus)
            try:
                with Listener(joined, log, str(import_map.bus.channel or "can0")) as listener:
                    for axis, entry in import_map.axes.items():
                        if not no_ask and not listener.ask_scales(entry.node or 0, ended.is_set):
                            said = f"{axis}: node {entry.node} does not answer by SDO, or its master is always using SDO"
                            console.print(f"{said}: its scales are taken from log and map", highlight=False)
                    console.print("recording; Ctrl-C ends it" if seconds is None else f"recording for {seconds:g} s")
                    listener.listen(seconds, ended.is_set)
            finally:
                joined.shutdown()
            recording = import_recording(log, import_map if map_ is not None else _with_demand(log, import_map), name=out.name)
            write_into(recording, staged, inputs=recording.files)
            if mcap:
                write_mcap(staged / MCAP, recording, _statuswords(log, import_map, recording), _first_stamp(log))
    console.print(summary([recording], import_map))
    console.print(f"1 recording in {out}, {listener.frames} frames in {out / LOG}", highlight=False, soft_wrap=True)


def _map(path: Path | None, eds: Path | None, nodes: list[int] | None, lockstep: bool) -> ImportMap:
    """The user's, or one of the standard's objects of some nodes. Raises UserError where neither is told."""
    if path is not None:
        if nodes:
            raise UserError("--node is for --eds without a map; the map names the nodes")
        told = read_map(path)
    elif eds is not None and nodes:
        axes = {f"node_{number}": AxisMap(node=number, columns=_columns()) for number in nodes}
        told = ImportMap(machine="recorded", axes=axes)
    else:
        raise UserError("nothing says which objects to record: give --map MAP.yaml, or --eds FILE and --node ID of each drive")
    changes = {"eds": eds.absolute()} if eds is not None else {}
    layout = BusLayout.model_validate(told.bus.model_dump() | changes | ({"grid": "count"} if lockstep else {}))
    for axis, entry in told.axes.items():
        if entry.node is None:
            raise UserError(f"{told.path}: axes.{axis}.node is missing; a drive on a bus has a node ID (1 to 127)")
    return told.model_copy(update={"bus": layout})


def _columns() -> dict[str, ColumnMap]:
    return {
        "position": ColumnMap(object=(0x6064, 0), unit="user"),
        "torque": ColumnMap(object=(0x6077, 0), unit="permille"),
        "velocity": ColumnMap(object=(0x606C, 0), unit="user/s", optional=True),
    }


def _with_demand(log: Path, import_map: ImportMap) -> ImportMap:
    """The same with that object as the demand which the log has."""
    for key in DEMANDS:
        demand = ColumnMap(object=key, unit="user", optional=True)
        axes = {
            name: entry.model_copy(update={"columns": entry.columns | {"position_demand": demand}})
            for name, entry in import_map.axes.items()
        }
        tried = import_map.model_copy(update={"axes": axes})
        recording = import_recording(log, tried)
        if any("position_demand" in columns for columns in recording.columns.values()):
            return tried
    return import_map


def _statuswords(log: Path, import_map: ImportMap, recording: Recording) -> dict[str, dict[str, Samples]]:
    """6041h (n,) of each axis whose PDOs carry it, at the recording's times: the last one before."""
    word = {STATUSWORD: ColumnMap(object=(0x6041, 0), type="uint16", optional=True)}
    axes = {axis: entry.model_copy(update={"columns": entry.columns | word}) for axis, entry in import_map.axes.items()}
    bus = read_bus_log(log, import_map.model_copy(update={"axes": axes}))
    places = np.clip(np.searchsorted(bus.time, recording.time + 1e-9, "right") - 1, 0, None)
    return {axis: {STATUSWORD: raw[STATUSWORD][places]} for axis, raw in bus.raw.items() if STATUSWORD in raw}


def _first_stamp(log: Path) -> float:
    """When the first frame came [s since 1970]."""
    with log.open(encoding="ascii") as lines:
        return float(lines.readline().partition(")")[0].lstrip("("))
