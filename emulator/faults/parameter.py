"""The parameters of a fault, each with its meaning, its unit and its valid values."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import isfinite

ALL = "all"
"""In the place of a node: every one."""


@dataclass(frozen=True)
class Parameter(ABC):
    """A parameter by its name; `meaning` is for who chooses a value."""

    name: str
    meaning: str

    @property
    @abstractmethod
    def expected(self) -> str:
        """What may be given, in words."""

    @abstractmethod
    def read(self, given: object) -> object:
        """The value of what YAML, JSON or a command line gives. Raises ValueError where it is none of those expected."""


@dataclass(frozen=True)
class Number(Parameter):
    """A number with a unit, `low` to `high`."""

    unit: str
    low: float
    high: float

    @property
    def expected(self) -> str:
        return f"a number from {self.low:g} to {self.high:g} {self.unit}".rstrip()

    def read(self, given: object) -> float:
        if isinstance(given, bool) or not isinstance(given, int | float | str):
            raise ValueError
        value = float(given)
        if not isfinite(value) or not self.low <= value <= self.high:
            raise ValueError
        return value


@dataclass(frozen=True)
class Whole(Parameter):
    """A whole number, `low` to `high`, in text also as hexadecimal (0x2310)."""

    low: int
    high: int
    hexadecimal: bool = False

    @property
    def expected(self) -> str:
        low, high = (f"0x{bound:X}" if self.hexadecimal else str(bound) for bound in (self.low, self.high))
        return f"a whole number from {low} to {high}"

    def read(self, given: object) -> int:
        if isinstance(given, bool) or not isinstance(given, int | str):
            raise ValueError
        value = int(given, 0) if isinstance(given, str) else given
        if not self.low <= value <= self.high:
            raise ValueError
        return value


@dataclass(frozen=True)
class Word(Parameter):
    """One of some words."""

    words: tuple[str, ...]

    @property
    def expected(self) -> str:
        return " or ".join(self.words)

    def read(self, given: object) -> str:
        if not isinstance(given, str) or given not in self.words:
            raise ValueError
        return given


@dataclass(frozen=True)
class NodeName(Parameter):
    """A drive, by the node-ID that the machine gives it or by its axis's name, or all."""

    @property
    def expected(self) -> str:
        return f"a node-ID from 1 to 127, an axis's name, or {ALL}"

    def read(self, given: object) -> int | str:
        if isinstance(given, bool) or not isinstance(given, int | str) or given == "":
            raise ValueError
        if isinstance(given, str) and not given.isdecimal():
            return given
        if not 1 <= int(given) <= 127:
            raise ValueError
        return int(given)


NODE = NodeName("node", "whose drive or axis")
