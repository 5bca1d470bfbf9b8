"""Frozen dataclasses of numbers as rows of the record array that compiled code reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from functools import cache
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.place import Place


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


def records(kinds: tuple[type, ...], rows: Sequence[tuple[object, ...]]) -> NDArray[np.void]:
    """Record array (n,), n may be 0, with the fields (float) of each part by its kind, of its place where it stands beside."""
    layout, names = _layout(kinds)
    return np.array([tuple(getattr(row[index], name) for index, name in names) for row in rows], dtype=layout)


@cache
def _layout(kinds: tuple[type, ...]) -> tuple[np.dtype[np.void], list[tuple[int, str]]]:
    """Of a record with the fields of these kinds of parts: its type, and which part each field is of."""
    columns = [(index, field) for index, kind in enumerate(kinds) for field in fields(kind)]
    layout = np.dtype([(field.name, "i8" if field.type == "int" else "f8") for _, field in columns])
    return layout, [(index, field.name) for index, field in columns]
