"""`drivetwin fault`: something goes wrong now, on a running emulator."""

from __future__ import annotations

import json
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated

import typer

from drivetwin.cli.terminal import AsJson
from drivetwin.emulator.faults.base import Fault, LastingFault
from drivetwin.emulator.faults.library import described, library, read_fault
from drivetwin.foundation.control_socket import ask_control
from drivetwin.foundation.errors import UserError


def fault_command(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(metavar="FAULT", help="Its name; --list shows all.", show_default=False)] = None,
    on: Annotated[Path | None, typer.Option(metavar="PATH", help="The --control socket of the running emulator.")] = None,
    node: Annotated[str | None, typer.Option(help="The drive or axis: node-ID, name of the axis, or all.")] = None,
    duration: Annotated[
        str | None, typer.Option("--for", metavar="SECONDS", help="Duration in simulated time; default: until --end.")
    ] = None,
    end: Annotated[bool, typer.Option("--end", help="End the fault; give the same parameters.")] = False,
    list_: Annotated[bool, typer.Option("--list", help="Show every fault with its parameters.")] = False,
    json_: AsJson = False,
) -> None:
    """Inject a fault into a running emulator. Other options are the fault's parameters: --code 0x2310.

    Example: drivetwin fault sto --node 2 --for 0.5 --on out/control

    Start the emulator with --control out/control. docs/faults.md says what each fault does on bus and machine.
    """
    if list_ and json_:
        print(json.dumps({kind.name: described(kind) for kind in library().values()}, indent=1, ensure_ascii=False))
        return
    if list_:
        print("\n\n".join(_described(kind) for kind in library().values()))
        return
    if name is None or on is None:
        raise UserError("say which fault, and on which emulator: drivetwin fault sto --node 2 --on PATH; or --list")
    if end and duration is not None:
        raise UserError("--for is how long a fault lasts that is struck; leave it out with --end")
    told: dict[str, object] = {"fault": name, "node": node, **_parameters(context.args)}
    read_fault(told)
    answer = ask_control(on, {"end": told} if end else {"strike": told, "for": duration})
    if json_:
        print(json.dumps(answer))
        return
    print(f"{answer['fault']} {'ended' if end else 'struck'} at {answer['time']:.6f} s")


def _parameters(words: list[str]) -> dict[str, object]:
    """Of `--name value` and `--name=value`."""
    told: dict[str, object] = {}
    rest = iter(words)
    for word in rest:
        option, equals, value = word.partition("=")
        given = value if equals else next(rest, None)
        if not option.startswith("--") or given is None:
            raise UserError(f"{word!r} is not a parameter with a value; write for example --code 0x2310")
        told[option.removeprefix("--").replace("-", "_")] = given
    return told


def _described(kind: type[Fault]) -> str:
    """Name, what it is, and a line for each parameter."""
    lasts = "until it is ended, or --for" if issubclass(kind, LastingFault) else "strikes once"
    summary = " ".join((kind.__doc__ or "").split())
    defaults = {field.name: field.default for field in fields(kind)}
    lines = [f"{kind.name} ({lasts})", f"  {summary}"]
    for parameter in kind.parameters:
        default = defaults[parameter.name]
        told = "" if default in (MISSING, None) else f" [{default}]"
        needed = " (needed)" if default is MISSING else ""
        option = parameter.name.replace("_", "-")
        lines.append(f"  --{option}{told}{needed}: {parameter.meaning}; {parameter.expected}")
    return "\n".join(lines)
