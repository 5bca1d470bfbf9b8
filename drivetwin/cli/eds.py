"""`drivetwin eds`: the electronic data sheet of a drive type, for a master or its configuration tool."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivetwin.cli.out_file import refuse_out_file
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.emulator.drive.power_on import commissioned, undecided
from drivetwin.emulator.machine import load_machine
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_file


def eds_command(
    out: Annotated[Path, typer.Option(help="The file to write, for example servoone.eds.")],
    profile: Annotated[str, typer.Option(help="Drive type, as for `drivetwin emulate`.")] = "servoone",
    machine: Annotated[
        str | None, typer.Option(help="The machine of the drive: DefaultValue then contains its power-on values.")
    ] = None,
    axis: Annotated[str | None, typer.Option(help="The axis of that machine; not needed if it has one axis.")] = None,
) -> None:
    """Write the EDS (CiA 306) of a drive type.

    DefaultValue is the value at power-on. Where it depends on the axis, it stays empty unless --machine and --axis are given.

    Example: drivetwin eds --profile cia402-full --machine scara --axis lift --out lift.eds
    """
    text = eds_text(_at_power_on(load_profile(profile), machine, axis), out.name)
    refuse_out_file(out, f"{profile}.eds")
    with new_file(out) as part:
        part.write_text(text, encoding="ascii")
    print(f"{out}: EDS of {profile}")


def _at_power_on(profile: DriveProfile, machine: str | None, axis: str | None) -> DriveProfile:
    if machine is None:
        if axis is not None:
            raise UserError(f"--axis {axis} needs the machine that it is of: give --machine")
        return undecided(profile)
    axes = load_machine(machine).axes
    if axis is None and len(axes) > 1:
        raise UserError(f"machine {machine} has the axes {', '.join(axes)}; say which by --axis")
    chosen = next(iter(axes)) if axis is None else axis
    if chosen not in axes:
        raise UserError(f"machine {machine} has no axis {chosen!r}; it has {', '.join(axes)}")
    return commissioned(profile, axes[chosen])
