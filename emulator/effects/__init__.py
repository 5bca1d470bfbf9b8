"""The library of effects: one class a file, found by listing this folder."""

from emulator.effects.base import AxisEffect, DriveEffect, Effect, ModelEffect, Need, Parameter, Start, StaticEffect
from emulator.effects.file import PlacedEffect, read_effects
from emulator.effects.library import library

__all__ = [
    "AxisEffect",
    "DriveEffect",
    "Effect",
    "ModelEffect",
    "Need",
    "Parameter",
    "PlacedEffect",
    "Start",
    "StaticEffect",
    "library",
    "read_effects",
]
