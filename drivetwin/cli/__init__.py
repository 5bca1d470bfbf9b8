"""The command `drivetwin`: one subcommand a file, errors as one line."""

from __future__ import annotations

import logging
import signal
import sys
from typing import NoReturn

import can
import typer
from typer.exceptions import Abort, TyperException

from drivetwin.cli.accept import accept_command
from drivetwin.cli.blind import blind_command
from drivetwin.cli.bus_load import bus_load_command
from drivetwin.cli.diagnose import diagnose_command
from drivetwin.cli.eds import eds_command
from drivetwin.cli.emulate import emulate_command
from drivetwin.cli.excite import excite_command
from drivetwin.cli.fault import PARAMETERS, fault_command
from drivetwin.cli.fit import fit_command
from drivetwin.cli.identify import identify_command
from drivetwin.cli.import_ import import_command
from drivetwin.cli.many_values import ManyToValidate
from drivetwin.cli.snapshot import snapshot_command
from drivetwin.cli.write_friction import write_friction_command
from drivetwin.errors import UserError, one_line

app = typer.Typer(
    name="drivetwin",
    help="""A hardware-in-the-loop bench without the hardware.

    Example: drivetwin identify --machine scara --out out/identify
    """,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

app.command("accept")(accept_command)
app.command("blind")(blind_command)
app.command("bus-load")(bus_load_command)
app.command("diagnose", cls=ManyToValidate)(diagnose_command)
app.command("eds")(eds_command)
app.command("emulate")(emulate_command)
app.command("excite")(excite_command)
app.command("fault", context_settings=PARAMETERS)(fault_command)
app.command("fit")(fit_command)
app.command("identify")(identify_command)
app.command("import")(import_command)
app.command("snapshot")(snapshot_command)
app.command("write-friction")(write_friction_command)


INTERRUPTED = 130
"""What typer makes of a Ctrl-C, and the exit status that shells give it."""


class LineFormatter(logging.Formatter):
    """Level, logger and message as one printable line: what a file holds does not write on the terminal."""

    def __init__(self) -> None:
        super().__init__("%(levelname)s %(name)s: %(message)s")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802  # as logging names it
        return one_line(super().formatMessage(record))


def main() -> None:
    """Run the command line; whatever a user can set right is one line on stderr and exit status 2, Ctrl-C is 130.

    A command may exit with a status of its own, which says what it found.
    """
    handler = logging.StreamHandler()
    handler.setFormatter(LineFormatter())
    logging.basicConfig(level=logging.WARNING, handlers=[handler])
    for library in ("can", "canopen"):
        logging.getLogger(library).setLevel(logging.CRITICAL)  # what they log is raised as well
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as Ctrl-C does: nothing half-written stays behind
    try:
        status = app(standalone_mode=False)
    except UserError as error:
        _end(str(error), error.exit_status)
    except can.CanError as error:
        _end(f"{error}", UserError.exit_status)
    except OSError as error:
        _end(f"{error.strerror or error}: {error.filename or 'input or output'}", UserError.exit_status)
    except Abort:
        _end("not confirmed (--yes confirms without asking); nothing was done", UserError.exit_status)
    except TyperException as error:
        message = " ".join(error.format_message().split()).rstrip(".?") or "no command given"
        _end(f"{message}; see: drivetwin --help", UserError.exit_status)
    if status == INTERRUPTED:
        _end("interrupted", INTERRUPTED)
    if status:
        sys.exit(status)


def _end(message: str, status: int) -> NoReturn:
    print(f"drivetwin: {one_line(message)}", file=sys.stderr)
    sys.exit(status)
