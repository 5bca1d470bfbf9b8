"""How a mutant modifies the controller: one attribute replaced, an axis described wrongly, checks removed."""

from __future__ import annotations

from collections.abc import Callable

import drivetwin.controller.tasks.file as task_file
from drivetwin.controller import supervision
from drivetwin.controller.machine import Axis, Machine, load_machine


def replace(owner: object, name: str, broken: object) -> None:
    """Put `broken` in the place of an attribute. Raises AttributeError where there is none: it would break nothing."""
    getattr(owner, name)
    setattr(owner, name, broken)


def misdescribe(name: str, change: Callable[[Axis], Axis]) -> None:
    """Let the controller take an axis for another than its axes.yaml describes."""
    def broken(machine_name: str) -> Machine:
        machine = load_machine(machine_name)
        return machine.model_copy(update={"axes": machine.axes | {name: change(machine.axes[name])}})

    replace(task_file, "load_machine", broken)


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
