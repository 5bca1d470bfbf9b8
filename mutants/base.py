"""What a mutant is: the reference controller with one thing broken, and the case that is meant to catch it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class CaughtBy:
    """The case (`08_faults.drive_fault`) that has to reject a mutant, and the expectation that has to fail in it."""

    case: str
    expectation: str


@dataclass(frozen=True)
class Mutant:
    """`breaks` says in a sentence what is wrong with it; `break_controller` puts it into the controller of this process."""

    name: str
    breaks: str
    caught_by: CaughtBy
    break_controller: Callable[[], None]
