"""The command `drivetwin`: one subcommand a file, errors as one line."""

from __future__ import annotations

import logging
import signal
import sys
from importlib.metadata import version
from typing import Annotated, NoReturn

import typer
from typer.exceptions import Abort, TyperException

from drivetwin.cli.commands import Commands, add_commands
from drivetwin.foundation.errors import UserError, one_line
from drivetwin.foundation.extras import missing_extra

app = typer.Typer(
    name="drivetwin",
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
add_commands(app)


def _tell_version(asked: bool) -> None:
    if asked:
        print(f"drivetwin {version('drivetwin')}")
        raise typer.Exit


@app.callback()
def drivetwin(
    _version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_tell_version, help="Show the version and exit.")
    ] = False,
) -> None:
    """A hardware-in-the-loop bench without the hardware.

    Example: drivetwin identify --machine scara --out out/identify
    """


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
    except ModuleNotFoundError as error:
        if (missing := missing_extra(error)) is None:
            raise
        _end(str(missing), missing.exit_status)
    except _bus_errors() as error:  # asked only where something was raised
        _end(f"{error}", UserError.exit_status)
    except OSError as error:
        _end(f"{error.strerror or error}: {error.filename or 'input or output'}", UserError.exit_status)
    except Abort:
        _end("not confirmed (--yes confirms without asking); nothing was done", UserError.exit_status)
    except TyperException as error:
        message = " ".join(error.format_message().split()).rstrip(".?") or "no command given"
        _end(f"{message}{_value_of(error)}; see: {_help_of(error)}", UserError.exit_status)
    if status == INTERRUPTED:
        _end("interrupted", INTERRUPTED)
    if status:
        sys.exit(status)


def _bus_errors() -> tuple[type[Exception], ...]:
    """What python-can raises, where a command has loaded it."""
    loaded = sys.modules.get("can")
    return () if loaded is None else (loaded.CanError,)


def _value_of(error: TyperException) -> str:
    """The value that was refused, where the message says only what it should be."""
    from pydantic import ValidationError  # noqa: PLC0415  # typer has loaded it by then; `--help` does without

    refused = error.__cause__
    said = refused.errors()[0] if isinstance(refused, ValidationError) else None
    return f"; it is '{said['input']!s:.80}'" if said is not None and said["type"] != "value_error" else ""


def _help_of(error: TyperException) -> str:
    """The command that tells the options of the one that was called wrongly."""
    context = getattr(error, "ctx", None)
    if context is None or context.parent is None:
        return "drivetwin --help"
    return f"drivetwin {context.info_name} -h"


def _end(message: str, status: int) -> NoReturn:
    print(f"drivetwin: {one_line(message)}", file=sys.stderr)
    sys.exit(status)
