"""The library of effects: one class a file, found by listing this folder."""

from emulator.effects.base import Effect, Parameter, StaticEffect
from emulator.effects.file import PlacedEffect, read_effects
from emulator.effects.library import library

__all__ = ["Effect", "Parameter", "PlacedEffect", "StaticEffect", "library", "read_effects"]
