"""What was made lately, for those who ask for the same again: a search comes back to where it stands and to its neighbours."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


@dataclass(frozen=True)
class Lately(Generic[Key, Value]):
    """Values by key, of which only those last asked for are kept; several threads may ask at once."""

    _values: dict[Key, Value] = field(init=False, repr=False, default_factory=dict)
    _lock: Lock = field(init=False, repr=False, compare=False, default_factory=Lock)

    def get(self, key: Key, made: Callable[[], Value], most: int) -> Value:
        """The value of a key, made where it is not kept; `most`: how many are kept. Raises what `made` raises."""
        with self._lock:
            known = self._values.pop(key, None)
        value = made() if known is None else known
        with self._lock:
            self._values[key] = value
            while len(self._values) > most:
                del self._values[next(iter(self._values))]
        return value


@dataclass(frozen=True)
class OfSame:
    """What was made of the same objects lately, by their identity: arrays are not compared, and nobody writes to them."""

    _made: Lately[tuple[int, ...], tuple[tuple[object, ...], Any]] = field(init=False, repr=False, default_factory=Lately)

    def get(self, objects: tuple[object, ...], made: Callable[[], Value], most: int) -> Value:
        """What is made of some objects, which live on as long as that is kept; `most`: how many are kept."""
        found: Value = self._made.get(tuple(map(id, objects)), lambda: (objects, made()), most)[1]
        return found
