"""The option `--effects-from FILE.py`: effects of the user's own beside those of the library."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from drivetwin.emulator.effects import add_effects, read_effect_file

EffectsFrom = Annotated[
    list[Path] | None,
    typer.Option(
        "--effects-from", metavar="FILE.py", help="A Python file with effects of your own (docs/effects.md); repeatable."
    ),
]


def use_effects(files: Sequence[Path] | None) -> None:
    """Let the library have the effects of these files; raises UserError for a file that holds none, or a flawed one."""
    add_effects(read_effect_file(path) for path in files or ())
