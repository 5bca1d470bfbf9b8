"""Finds every effect of this folder, so that adding an effect is adding a file."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from pathlib import Path
from types import ModuleType

from emulator.effects.base import Effect

_NOT_EFFECTS = {"base", "file", "library", "model_tree", "springs", "waves"}


@cache
def library() -> dict[str, type[Effect]]:
    """Every effect class by its name."""
    folder = pkgutil.iter_modules([str(Path(__file__).parent)])
    modules = [importlib.import_module(f"emulator.effects.{info.name}") for info in folder if info.name not in _NOT_EFFECTS]
    return {effect.name: effect for module in modules for effect in _effects_in(module)}


def _effects_in(module: ModuleType) -> list[type[Effect]]:
    return [
        kind
        for kind in vars(module).values()
        if isinstance(kind, type) and issubclass(kind, Effect) and kind.__module__ == module.__name__
    ]
