"""`drivetwin snapshot`: every object of a live drive in a file, which `drivetwin emulate --snapshot` loads."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from drivetwin.bus.channel import open_bus
from drivetwin.cli.out_file import refuse_out_file
from drivetwin.cli.terminal import Quiet
from drivetwin.controller.link import Link
from drivetwin.controller.snapshot import take_snapshot
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.snapshot import Snapshot, write_snapshot


def snapshot_command(
    bus: Annotated[str, typer.Option(help="vcan0, can0, unix:PATH or ws://127.0.0.1:PORT.")],
    node: Annotated[int, typer.Option(min=1, max=127, help="Node-ID of the drive.")],
    out: Annotated[Path, typer.Option(help="The file to write, for example axis1.json.")],
    profile: Annotated[str, typer.Option(help="Drive type: defines the objects to read.")] = "servoone",
    eds: Annotated[Path | None, typer.Option(help="The drive's own EDS or DCF: defines the objects instead.")] = None,
    quiet: Quiet = False,
) -> None:
    """Read every object of a live drive by SDO. Nothing is written to the drive, and nothing moves.

    Example: drivetwin snapshot --bus can0 --node 1 --profile servoone --out axis1.json

    Objects that the drive refuses are recorded with their abort code.
    """
    drive_type = load_profile(profile)
    if eds is not None:
        drive_type = profile_from_eds(eds, drive_type)
    refuse_out_file(out, "axis1.json")
    with Link(open_bus(bus)) as link:
        taken = _take(link, node, drive_type, silent=quiet)
    write_snapshot(out, taken, [] if eds is None else [eds])
    refused = sum(1 for reading in taken.readings if reading.data is None)
    if not quiet:
        print(f"{out}: node {node}, {len(taken.readings)} objects, {refused} of them refused")


def _take(link: Link, node: int, drive_type: DriveProfile, *, silent: bool) -> Snapshot:
    console = Console(stderr=True, quiet=silent)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as bars:
        task = bars.add_task(f"node {node}", total=len(drive_type.objects))
        return take_snapshot(link, node, drive_type, lambda done: bars.update(task, completed=done))
