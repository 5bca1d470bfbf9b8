"""Frozen dataclasses of numbers, side by side in the record array that compiled code reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from emulator.dynamics.place import Place


class Part(Protocol):
    """A part of an axis that may be absent from its dynamics."""

    @property
    def acts(self) -> bool:
        """Whether compiled code has anything to do for it."""
        ...


P = TypeVar("P", bound=Part)


def acting(parts: Sequence[P], places: Sequence[Place]) -> list[tuple[P, Place]]:
    """The parts that act, each with its axis's place."""
    return [(part, place) for part, place in zip(parts, places, strict=True) if part.acts]


def records(rows: Sequence[tuple[object, ...]]) -> NDArray[np.void]:
    """Record array (n,) with the fields (float) of each part, and of its place where it stands beside."""
    columns = [(index, field) for index, value in enumerate(rows[0]) for field in fields(value)]  # type: ignore[arg-type]
    packed = np.zeros(len(rows), dtype=[(field.name, "i8" if field.type == "int" else "f8") for _, field in columns])
    for index, field in columns:
        packed[field.name] = [getattr(row[index], field.name) for row in rows]
    return packed
