"""Enumerations for code that runs in every cycle."""

from __future__ import annotations

from enum import Enum
from typing import TypeVar

AnyEnum = TypeVar("AnyEnum", bound=type[Enum])


def quick(enumeration: AnyEnum) -> AnyEnum:
    """Let `State.FAULT` be found as any attribute of a class is, ten times as fast as through the property of Python 3.11."""
    for name, member in enumeration.__members__.items():
        type.__setattr__(enumeration, name, member)
    return enumeration
