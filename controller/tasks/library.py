"""Finds the tasks of this folder by their files' names; only the one that is asked for is imported."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

from drivetwin.controller.tasks.base import Task
from drivetwin.foundation.errors import UserError

_NO_TASKS = {"base", "library", "file"}


def task_names() -> tuple[str, ...]:
    """What `task_class` knows."""
    modules = (module.name for module in pkgutil.iter_modules([str(Path(__file__).parent)]))
    return tuple(name for name in modules if name not in _NO_TASKS)


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
