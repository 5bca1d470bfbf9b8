"""What a command writes: tables and bars for a person, one JSON document for a program, or nothing."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Write no tables and no progress; errors and exit status stay.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write the result as one JSON document, in place of all else.")]


def terminal(*, silent: bool = False, markup: bool = True) -> Console:
    """Standard output, wide enough for the tables; `silent` writes nothing.

    Without `markup` what others wrote is shown as they wrote it.
    """
    return Console(width=max(120, Console().width), quiet=silent, markup=markup, emoji=markup)
