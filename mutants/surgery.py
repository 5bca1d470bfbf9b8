"""How a mutant modifies the controller: one attribute replaced, an axis described wrongly, checks removed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drivetwin.controller.tasks.file as task_file
from drivetwin.controller import supervision
from drivetwin.controller.machine import Axis, Machine

Original = Callable[..., Any]
"""What stood where something broken stands."""


def replace(owner: object, name: str, broken: object) -> None:
    """Put `broken` in the place of an attribute. Raises AttributeError where there is none: it would break nothing."""
    getattr(owner, name)
    setattr(owner, name, broken)


def instead_of(owner: object, name: str) -> Callable[[Callable[..., Any]], Callable[[], None]]:
    """Makes `break_controller` of what is to stand in the place of a function; it gets the original, then the arguments."""

    def breaking(broken: Callable[..., Any]) -> Callable[[], None]:
        def break_controller() -> None:
            original = getattr(owner, name)
            replace(owner, name, lambda *arguments, **named: broken(original, *arguments, **named))

        return break_controller

    return breaking


def misdescribed(name: str) -> Callable[[Callable[[Axis], Axis]], Callable[[], None]]:
    """Makes `break_controller` of how the controller takes an axis for another than its axes.yaml describes."""

    def breaking(change: Callable[[Axis], Axis]) -> Callable[[], None]:
        @instead_of(task_file, "load_machine")
        def break_controller(load: Original, machine_name: str) -> Machine:
            machine: Machine = load(machine_name)
            return machine.model_copy(update={"axes": machine.axes | {name: change(machine.axes[name])}})

        return break_controller

    return breaking


def leave_out(*checks: supervision.Check) -> None:
    """Let the controller supervise its drives without these checks. Raises ValueError for one that it does not make.

    A drive that is silent is not waited for, either way.
    """
    left = list(supervision.CHECKS)
    for check in checks:
        left.remove(check)
    if supervision.silent in checks:
        left.append(_not_waited_for)
    replace(supervision, "CHECKS", tuple(left))


def _not_waited_for(watch: supervision.Watch) -> None:
    """As `silent`, which tells nobody."""
    supervision.silent(watch)
