"""The subcommands by name, each imported when it is called: help and completion list them all and load none."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from drivetwin.cli.many_values import ManyToValidate


@dataclass(frozen=True)
class Entry:
    """Where a subcommand stands in this folder, and what `drivetwin --help` says of it: the first line of its own help."""

    place: str
    """MODULE:FUNCTION."""
    summary: str
    cls: type[TyperCommand] = TyperCommand
    context: Mapping[str, Any] = field(default_factory=dict)

    def load(self, name: str) -> Any:
        """The command itself, with all that it imports."""
        module, _, function = self.place.partition(":")
        alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        callback = getattr(import_module(f"drivetwin.cli.{module}"), function)
        alone.command(name, cls=self.cls, context_settings=dict(self.context), help=_paragraphs(callback))(callback)
        return typer.main.get_command(alone)


def _paragraphs(command: Callable[..., Any]) -> str:
    """What a command says of itself, each paragraph as one line: the terminal says where it is broken."""
    return "\n\n".join(" ".join(each.split()) for each in (inspect.getdoc(command) or "").split("\n\n"))


_REST_IS_THE_FAULTS = {"allow_extra_args": True, "ignore_unknown_options": True}
"""What `drivetwin fault` does not know as an option of its own are parameters of the fault."""

COMMANDS = {
    "accept": Entry("accept:accept_command", "Run a controller through the acceptance suite."),
    "apply": Entry("apply:apply_command", "Write what was identified or diagnosed into a model."),
    "blind": Entry("blind:blind_command", "Test the diagnosis on machines whose effects it cannot know."),
    "bode": Entry(
        "bode:bode_command",
        "Measure the frequency response of the velocity and position loop over the bus, and propose gains with margins.",
    ),
    "bus-load": Entry(
        "bus_load:bus_load_command",
        "Compute the load of a physical bus from a log: mean, worst window, by service, and whether the frames would fit.",
    ),
    "diagnose": Entry(
        "diagnose:diagnose_command",
        "Find where the simulation and the machine differ, which unmodelled effect causes it, and how far the gap shrinks.",
        cls=ManyToValidate,
    ),
    "eds": Entry("eds:eds_command", "Write the EDS (CiA 306) of a drive type."),
    "emulate": Entry("emulate:emulate_command", "Put a virtual machine's drives on a bus and let any master command them."),
    "excite": Entry(
        "excite:excite_command",
        "Write the motion that distinguishes what a report could not: move the machine, record, diagnose again.",
    ),
    "fault": Entry(
        "fault:fault_command",
        "Inject a fault into a running emulator. Other options are the fault's parameters: --code 0x2310.",
        context=_REST_IS_THE_FAULTS,
    ),
    "fit": Entry("fit:fit_command", "Identify inertia and friction from recordings by least squares."),
    "identify": Entry("identify:identify_command", "Identify the friction of every axis over the bus."),
    "import": Entry("import_:import_command", "Turn a drive's exports or a bus log into recordings."),
    "machine": Entry("machine:machine_command", "Make a machine of your own from a robot's model, or check one."),
    "panel": Entry(
        "panel:panel_command",
        "Look at drives in the browser: states, parameters, faults. Without a bus it starts the SCARA in motion.",
    ),
    "record": Entry("record:record_command", "Record any drives that any master moves, by listening to their bus."),
    "replay": Entry(
        "replay:replay_command", "Move a model as a machine was moved, in closed loop, and report the differences."
    ),
    "snapshot": Entry(
        "snapshot:snapshot_command",
        "Read every object of a live drive by SDO. Nothing is written to the drive, and nothing moves.",
    ),
    "write-friction": Entry(
        "write_friction:write_friction_command",
        "Write identified friction into the drives' own friction tables (servoone: 2182h, 2183h).",
    ),
}


class Commands(TyperGroup):
    """A group of the commands above: what is listed is their summaries, what is called is loaded."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        name, command, rest = super().resolve_command(ctx, args)
        return name, COMMANDS[name].load(name) if name in COMMANDS else command, rest


def add_commands(app: typer.Typer) -> None:
    """Enter a stand-in of every command, for lists."""
    for name, entry in COMMANDS.items():
        app.command(name, help=entry.summary)(_stand_in)


def _stand_in() -> None:
    raise AssertionError("a command is loaded before it is called")
