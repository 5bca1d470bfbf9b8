"""The library of effects: one class a file, found by listing this folder; those of others in packages or files of their own."""

from drivetwin.emulator.effects.base import (
    FAMILIES,
    AxisEffect,
    DriveEffect,
    Effect,
    Exciting,
    FrictionEffect,
    Look,
    ModelEffect,
    Need,
    Parameter,
    PartEffect,
    Start,
    StaticEffect,
    TorqueEffect,
    Unit,
    UnnamedEffect,
)
from drivetwin.emulator.effects.file import PlacedEffect, read_effects
from drivetwin.emulator.effects.ground import Ground, Site
from drivetwin.emulator.effects.library import EffectFile, add_effects, added_effects, library, read_effect_file

__all__ = [
    "FAMILIES",
    "AxisEffect",
    "DriveEffect",
    "Effect",
    "EffectFile",
    "Exciting",
    "FrictionEffect",
    "Ground",
    "Look",
    "ModelEffect",
    "Need",
    "Parameter",
    "PartEffect",
    "PlacedEffect",
    "Site",
    "Start",
    "StaticEffect",
    "TorqueEffect",
    "Unit",
    "UnnamedEffect",
    "add_effects",
    "added_effects",
    "library",
    "read_effect_file",
    "read_effects",
]
