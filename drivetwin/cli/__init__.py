"""The command `drivetwin`: one subcommand a file, errors as one line."""

from __future__ import annotations

import logging
import sys

import typer

from drivetwin.cli.emulate import emulate_command
from drivetwin.cli.identify import identify_command
from drivetwin.cli.import_ import import_command
from drivetwin.errors import UserError

app = typer.Typer(
    name="drivetwin",
    help="A hardware-in-the-loop bench without the hardware.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

app.command("emulate")(emulate_command)
app.command("identify")(identify_command)
app.command("import")(import_command)


def main() -> None:
    """Run the command line; a UserError becomes one line on stderr and exit status 2."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    try:
        app()
    except UserError as error:
        print(f"drivetwin: {error}", file=sys.stderr)
        sys.exit(2)
