"""Finds the tasks of this folder by file name, and imports only the one that is requested."""

from __future__ import annotations

import importlib

from drivetwin.controller.tasks.base import Task
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.plugins import module_names

_NO_TASKS = {"base", "library", "file"}


def task_names() -> tuple[str, ...]:
    """What `task_class` knows."""
    return tuple(name for name in module_names("drivetwin.controller.tasks") if name not in _NO_TASKS)


def task_class(name: str) -> type[Task]:
    """The class of a task. Raises UserError naming the tasks that there are."""
    if name not in task_names():
        raise UserError(f"there is no task {name!r}; this controller can do {', '.join(task_names())}")
    module = importlib.import_module(f"drivetwin.controller.tasks.{name}")
    return next(
        kind
        for kind in vars(module).values()
        if isinstance(kind, type) and issubclass(kind, Task) and kind.__module__ == module.__name__
    )
