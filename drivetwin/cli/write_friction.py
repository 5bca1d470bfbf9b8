"""`drivetwin write-friction`: what was identified goes into the drives' own friction tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from drivetwin.bus.channel import INPROC, is_physical, open_bus
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.friction_precontrol import Planned, check_drive_type, plan, write_friction
from drivetwin.controller.friction_table import ALWAYS_ACTIVE, FrictionTable, Point, friction_table
from drivetwin.controller.link import Link
from drivetwin.controller.machine import Axis, Machine, load_machine
from drivetwin.controller.motor_check import check_motors
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.foundation.errors import UserError
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.read import read_friction

RPM = 2.0 * pi / 60.0
"""[rad/s]"""

console = Console(width=max(112, Console().width))


def write_friction_command(
    identified: Annotated[
        Path, typer.Argument(metavar="IDENTIFIED.json", help="identified.json of identify or fit.", show_default=False)
    ],
    machine: Annotated[
        str, typer.Option(metavar="NAME|DIR|FILE.yaml", help="Machine: scara, stage, arm or one of your own.")
    ] = "scara",
    profile: Annotated[str, typer.Option(help="Drive type on the bus: servoone, which has a friction table.")] = "servoone",
    bus: Annotated[str | None, typer.Option(help="vcan0, can0, unix:PATH or ws://127.0.0.1:PORT.")] = None,
    axis: Annotated[list[str] | None, typer.Option(help="Only this axis; may be repeated. Default: all in the file.")] = None,
    store: Annotated[bool, typer.Option("--store", help="The drives save their parameters (1010h:03).")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show the tables; use no bus, write nothing.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before writing on can0.")] = False,
) -> None:
    """Write identified friction into the drives' own friction tables (servoone: 2182h, 2183h).

    The drive then adds the friction torque to its demand. Shows each table before and after, and its worst deviation from the
    identified law. Nothing moves, and a drive whose voltage may be on is refused.

    Example: drivetwin write-friction out/identify/identified.json --bus ws://127.0.0.1:54701 --axis rotate --store

    --store saves every application parameter of the drive as it is now, not only the table.
    """
    known, drive_type = load_machine(machine), load_profile(profile)
    check_drive_type(drive_type)
    axes = _chosen(identified, known, axis)
    if dry_run:
        for one in axes:
            _show(one, None, friction_table(one.law, one.axis), None)
        console.print("nothing was written (--dry-run)")
        return
    if bus is None or bus == INPROC:
        raise UserError("which drives? give --bus can0, vcan0 or ws://127.0.0.1:PORT, or --dry-run to see the tables only")
    with Link(open_bus(bus)) as link:
        _write(link, known, axes, drive_type, must_ask=is_physical(bus) and not yes, store=store)


@dataclass(frozen=True)
class _Chosen:
    """An axis of the machine and the friction that was identified for it."""

    name: str
    axis: Axis
    law: FrictionLaw


def _chosen(identified: Path, machine: Machine, names: Sequence[str] | None) -> list[_Chosen]:
    """The named axes, or all that the file has. Raises UserError for one that file or machine has not."""
    friction = read_friction(identified)
    if friction.machine != machine.machine:
        raise UserError(f"{identified} is of machine {friction.machine}, and --machine is {machine.machine}")
    chosen = []
    for name in dict.fromkeys(names or friction.laws):
        law = friction.law(name)
        machine.check_axes([name])
        chosen.append(_Chosen(name, machine.axes[name], law))
    return chosen


def _write(
    link: Link, machine: Machine, axes: Sequence[_Chosen], profile: DriveProfile, *, must_ask: bool, store: bool
) -> None:
    """Check and show all, ask where that is due, then write all."""
    drives = [DriveNode(link, one.name, one.axis, profile) for one in axes]
    check_motors(drives, machine)
    planned = [Planned(drive, plan(drive, one.law)) for drive, one in zip(drives, axes, strict=True)]
    for one, change in zip(axes, (each.change for each in planned), strict=True):
        _show(one, change.before, change.table, change.rated_torque)
    if must_ask and not typer.confirm(f"Write these tables to the drives on {link.wire.channel_info}?"):
        raise UserError("not confirmed; nothing was written")
    write_friction(planned)
    for drive in drives:
        console.print(f"{drive.where()}: written and read back", highlight=False)
    for drive in drives if store else ():
        _store(drive)
        console.print(f"{drive.where()}: application parameters stored", highlight=False)


def _store(drive: DriveNode) -> None:
    try:
        drive.store_parameters()
    except UserError as error:
        raise UserError(
            f"{error}; its table is written and acts until it is reset (an emulator keeps parameters only with --store DIR)"
        ) from None


def _show(one: _Chosen, before: Sequence[Point] | None, table: FrictionTable, rated_torque: float | None) -> None:
    unit = "N" if one.axis.prismatic else "N·m"
    shown = Table(title=f"{one.name} (node {one.axis.node_id})", title_justify="left", box=box.SIMPLE_HEAD)
    shown.add_column("point")
    shown.add_column("acts")
    for moment in ("before", "after") if before is not None else ("after",):
        for quantity in ("1/min", "N·m of the motor", *(("% of rated",) if rated_torque is not None else ())):
            shown.add_column(f"{moment}, {quantity}", justify="right")
    for number, point in enumerate(table.points):
        former = [] if before is None else _cells(before[number], rated_torque)
        acts = "always" if number < ALWAYS_ACTIVE else "accelerating"
        shown.add_row(str(number + 1), acts, *former, *_cells(point, rated_torque))
    console.print(shown)
    console.print(f"at worst {table.deviation:.3g} {unit} from the identified law (joint)", highlight=False)


def _cells(point: Point, rated_torque: float | None) -> list[str]:
    """Speed, torque, and its share of the rated torque where that is known."""
    share = [] if rated_torque is None else [f"{100.0 * point.torque / rated_torque:.4g}"]
    return [f"{point.speed / RPM:.4g}", f"{point.torque:.4g}", *share]
