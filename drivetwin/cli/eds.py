"""`drivetwin eds`: the electronic data sheet of a drive type, for a master or its configuration tool."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drive_profiles import load_profile
from drive_profiles.eds_writer import eds_text
from drivetwin.cli.out_file import refuse_out_file
from drivetwin.files import new_file


def eds_command(
    out: Annotated[Path, typer.Option(help="The file to write, for example servoone.eds.")],
    profile: Annotated[str, typer.Option(help="Drive type, as for `drivetwin emulate`.")] = "servoone",
) -> None:
    """Write the EDS (CiA 306) of a drive type.

    Example: drivetwin eds --profile servoone --out servoone.eds
    """
    text = eds_text(load_profile(profile), out.name)
    refuse_out_file(out, f"{profile}.eds")
    with new_file(out) as part:
        part.write_text(text, encoding="ascii")
    print(f"{out}: EDS of {profile}")
