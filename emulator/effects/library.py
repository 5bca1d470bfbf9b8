"""Finds every effect of this folder, so that adding an effect is adding a file."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from pathlib import Path

from emulator.effects.base import Effect

_NOT_EFFECTS = {"base", "file", "library"}


@cache
def library() -> dict[str, type[Effect]]:
    """Every effect class by its name."""
    modules = [info.name for info in pkgutil.iter_modules([str(Path(__file__).parent)]) if info.name not in _NOT_EFFECTS]
    for name in modules:
        importlib.import_module(f"emulator.effects.{name}")
    return {effect.name: effect for effect in sorted(Effect.__subclasses__(), key=lambda effect: effect.name)}
