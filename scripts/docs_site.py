"""A hook of MkDocs: the reference of the command line, generated from the commands themselves."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from typer.core import TyperArgument

from drivetwin.cli.commands import COMMANDS

PAGE = "command-line.md"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the page to those of the folder."""
    files.append(File.generated(config, PAGE, content=command_line()))
    return files


def command_line() -> str:
    """One section a command: its help, how it is called, arguments and options."""
    opening = (
        "# Command line\n\nThis page is generated from `drivetwin COMMAND --help`.\n\n"
        "Exit status of every command: 0 done; 1 a result that the command was asked to fail on; 2 an error: one line on "
        "standard error says what to correct; 130 Ctrl-C.\n"
    )
    return "\n".join([opening, *(line for name, entry in COMMANDS.items() for line in _section(name, entry.load(name)))])


def _section(name: str, command: Any) -> Iterator[str]:
    yield f"## drivetwin {name}\n"
    yield f"{_paragraphs(command.help or '')}\n"
    arguments = [each for each in command.params if isinstance(each, TyperArgument)]
    options = [each for each in command.params if each not in arguments and not each.hidden and each.name != "help"]
    context = typer.Context(command, info_name=name)
    called = " ".join(_metavar(each) for each in arguments)
    yield f"    drivetwin {name}{' ' if called else ''}{called} [OPTIONS]\n"
    for title, parameters in (("Argument", arguments), ("Option", options)):
        if parameters:
            yield f"| {title} | Meaning | Default |\n| --- | --- | --- |"
            yield from (_row(each, context) for each in parameters)
            yield ""


def _paragraphs(text: str) -> str:
    """Help as Markdown: examples become code."""
    blocks = [" ".join(block.split()) for block in text.split("\n\n")]
    return "\n\n".join(re.sub(r"^Example: (.*)$", r"Example: `\1`", block) for block in blocks)


def _metavar(parameter: Any) -> str:
    name = parameter.metavar or str(parameter.name).upper()
    many = "..." if parameter.nargs == -1 and not name.endswith("...") else ""
    return f"{name}{many}" if parameter.required else f"[{name}{many}]"


def _row(parameter: Any, context: Any) -> str:
    if isinstance(parameter, TyperArgument):
        shown = f"`{_metavar(parameter)}`"
    else:
        shown = ", ".join(f"`{each}`" for each in [*parameter.opts, *parameter.secondary_opts])
        if not parameter.is_flag:
            shown = f"{shown} `{parameter.metavar or parameter.display_type(context)}`"
    default = parameter.default
    told = "required" if parameter.required else "" if default in (None, False, (), "") or callable(default) else f"`{default}`"
    return f"| {shown} | {_cell(parameter.help or '')} | {told} |"


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())
