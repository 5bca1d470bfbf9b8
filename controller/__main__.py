"""The controller as a program that performs one task: `python -m drivetwin.controller task.json --bus vcan0 --out out`."""

from __future__ import annotations

import logging
import signal
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import can
import typer
from typer.exceptions import Abort, TyperException

from drivetwin.bus.channel import is_physical, open_bus
from drivetwin.controller.limits import Limits, read_limits, within
from drivetwin.controller.outcome import Ending, Outcome
from drivetwin.controller.pacing import PACINGS, Paced, Pacing
from drivetwin.controller.perform import Place, perform
from drivetwin.controller.tasks.file import Order, read_order
from drivetwin.foundation.errors import InterruptedByUserError, UserError

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

CLOCKS: dict[str, type[Pacing]] = {**PACINGS, "paced": Paced}


@app.command()
def control(
    task_file: Annotated[Path, typer.Argument(help="What to do, on which machine (task/1).", show_default=False)],
    bus: Annotated[str, typer.Option(help="vcan0, can0, unix:PATH or ws://127.0.0.1:PORT.")],
    out: Annotated[Path, typer.Option(help="Directory for controller.json and results.")],
    clock: Annotated[
        str,
        typer.Option(help="sync: as fast as it goes, moved by SYNC; paced: so, in step with the wall clock; realtime: on it."),
    ] = "sync",
    log: Annotated[Path | None, typer.Option(help="Write every frame, as candump -L does.")] = None,
    limits: Annotated[Path | None, typer.Option(help="Limits file (travel, speed, torque); required on can0.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="The machine on can0 is clear: axes may move.")] = False,
) -> None:
    """Do one task on a machine, from drives that have power to drives that are disabled.

    Exit status: 0 done; 3 stopped safely because of trouble on machine or bus; 2 refused, nothing was enabled; 130 after
    Ctrl-C, every axis stopped. OUT/controller.json says which, and why.

    Example: python -m drivetwin.controller task.json --bus unix:/tmp/bus --clock sync --out out/task
    """
    out.mkdir(parents=True, exist_ok=True)
    outcome = _do(task_file, bus, out, clock, log, limits, yes)
    outcome.write(out)
    if outcome.cycle_reason:
        print(f"drivetwin-control: {outcome.cycle_reason}", file=sys.stderr)
    if outcome.ending is not Ending.DONE:
        _end(outcome.reason, outcome.ending.exit_status)


def _do(task_file: Path, bus: str, out: Path, clock: str, log: Path | None, limits: Path | None, yes: bool) -> Outcome:
    try:
        order = read_order(task_file)
        if clock not in CLOCKS:
            raise UserError(f"unknown clock {clock!r}; expected {' or '.join(CLOCKS)}")
        order, allowed = _within_limits(order, limits, bus, clock, yes)
        place = Place(open_bus(bus), CLOCKS[clock](), allowed, out, log)
        return perform(order, place)
    except InterruptedByUserError:
        raise
    except UserError as error:
        return Outcome(Ending.REFUSED, str(error))


def _within_limits(order: Order, path: Path | None, bus: str, clock: str, yes: bool) -> tuple[Order, Limits | None]:
    """The order on a machine narrowed to its limits file; a bus that may be physical needs the file and --yes."""
    if is_physical(bus):
        if clock != "realtime":
            raise UserError(f"{bus} may be a real machine, whose drives have their own clock: give --clock realtime")
        if path is None or not yes:
            raise UserError(f"{bus} may be a real machine: give --limits FILE, and --yes where the machine is clear")
    if path is None:
        return order, None
    allowed = read_limits(path, order.machine)
    return order.on(within(order.machine, allowed)), allowed


def main() -> None:
    """Run the command line; whatever a user can set right is one line on stderr."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    for library in ("can", "canopen"):
        logging.getLogger(library).setLevel(logging.CRITICAL)  # what they log is raised as well
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        app(standalone_mode=False)
    except UserError as error:
        _end(str(error), error.exit_status)
    except KeyboardInterrupt:
        _end("interrupted", InterruptedByUserError.exit_status)
    except can.CanError as error:
        _end(f"{error}", UserError.exit_status)
    except OSError as error:
        _end(f"{error.strerror or error}: {error.filename or 'input or output'}", UserError.exit_status)
    except Abort:
        _end("interrupted", InterruptedByUserError.exit_status)
    except TyperException as error:
        message = " ".join(error.format_message().split()).rstrip(".") or "no task file given"
        _end(f"{message}; see: python -m drivetwin.controller --help", UserError.exit_status)


def _end(message: str, status: int) -> NoReturn:
    print(f"drivetwin-control: {message}", file=sys.stderr)
    sys.exit(status)


if __name__ == "__main__":
    main()
