"""The option `--effects-from FILE.py`: effects of the user's own beside those of the library."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from drivetwin.emulator.effects import add_effects, read_effect_file, read_effects
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

EffectsFrom = Annotated[
    list[Path] | None,
    typer.Option(
        "--effects-from", metavar="FILE.py", help="A Python file with effects of your own (docs/effects.md); repeatable."
    ),
]


def use_effects(files: Sequence[Path] | None) -> None:
    """Let the library have the effects of these files; raises UserError for a file that holds none, or a flawed one."""
    add_effects(read_effect_file(path) for path in files or ())


def say_what_lies_beside(model: Path, effects: Path | None) -> None:
    """Warn of effects that `drivetwin apply` wrote beside a model, where none are given: MJCF cannot express them."""
    beside = model.with_suffix(".effects.json")
    if effects is None and beside.is_file():
        with suppress(UserError):
            if read_effects(beside):
                logger.warning("%s lies beside the model and is not used: add --effects %s", beside, beside)
