"""The base of an expectation: its parameters, some of them limits of the bench, and its verdict on a case's evidence."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.task import Task
from drivetwin.hil_tests.verdict import Failure, Measured

ByAxis = Mapping[str, float]
"""A number for each axis."""

Ranges = Mapping[str, tuple[float, float]]
"""Lowest and highest for each axis."""

LIMIT = "limit"


def limit(name: str) -> dict[str, str]:
    """Metadata of a field: a parameter that is the bench's limit of that name, where the scenario does not say another."""
    return {LIMIT: name}


@dataclass(frozen=True)
class Finding:
    """What an expectation found: the requirements that were not met, and the quantities that it measured."""

    failures: tuple[Failure, ...] = ()
    measured: tuple[Measured, ...] = ()

    def __add__(self, other: Finding) -> Finding:
        return Finding(self.failures + other.failures, self.measured + other.measured)


MET = Finding()


@dataclass(frozen=True)
class Expectation(ABC):
    """One kind of requirement. Subclasses are frozen dataclasses whose fields are what a scenario may say of it."""

    name: ClassVar[str]
    needs_truth: ClassVar[bool]
    """Whether it is held against the plant's truth, which a real machine does not tell; else bus and controller say enough."""
    shorthand: ClassVar[str | None] = None
    """The parameter that `- name: value` gives."""

    def check(self, bench: Bench, task: Task, starts: int) -> None:
        """Raise UserError where it says nothing of a case with that task and so many starts of the controller."""
        return

    @abstractmethod
    def judge(self, evidence: Evidence) -> Finding:
        """Hold it against what was seen."""

    def fails(
        self,
        message: str,
        axis: str | None = None,
        time: float | None = None,
        measured: float | None = None,
        limit: float | None = None,
        unit: str = "",
    ) -> Finding:
        """The finding that it was not met."""
        return Finding((Failure(self.name, message, axis, time, measured, limit, unit),))

    def at_most(
        self,
        quantity: str,
        value: float,
        limit: float,
        unit: str,
        message: str,
        axis: str | None = None,
        time: float | None = None,
    ) -> Finding:
        """A measured quantity, which fails where it is above its limit, or not a number."""
        measured = Finding(measured=(Measured(quantity, value, unit, axis, limit),))
        return measured if value <= limit else measured + self.fails(message, axis, time, value, limit, unit)
