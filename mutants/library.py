"""Finds every mutant of mutants/broken by its file's name; only the one that is asked for is imported."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.mutants.base import Mutant


def mutant_names() -> tuple[str, ...]:
    """What `mutant` knows, in the order of the alphabet."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules([str(Path(__file__).parent / "broken")])))


def mutant(name: str) -> Mutant:
    """A mutant by its name. Raises UserError naming those that there are."""
    if name not in mutant_names():
        raise UserError(f"there is no mutant {name!r}; there are {', '.join(mutant_names())}")
    module = importlib.import_module(f"drivetwin.mutants.broken.{name}")
    return Mutant(name, " ".join(str(module.__doc__).split()), module.CAUGHT_BY, module.break_controller)
