"""The target positions of a task `move` or `path`, one pose after the other."""

from __future__ import annotations

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.task import Task


def targets(task: Task) -> list[dict[str, float]]:
    """Positions by axis [m or rad], in their order; none where the task is another.

    Raises UserError where they cannot be read.
    """
    parameters = task.parameters
    try:
        match task.task:
            case "move":
                poses = [{str(move["axis"]): float(move["to"])} for move in parameters["moves"]]
            case "path":
                poses = [{str(axis): float(to) for axis, to in pose.items()} for pose in parameters["poses"]]
            case _:
                return []
        repeat = int(parameters.get("repeat", 1))
    except (KeyError, TypeError, ValueError, AttributeError):
        raise UserError(f"task: {task.task}: nobody can read from its parameters where axes go: {parameters}") from None
    if repeat < 1:
        raise UserError(f"task: {task.task}: repeat: expected 1 or more, not {repeat}")
    return poses * repeat


def check_targets(task: Task, bench: Bench) -> None:
    """Raise UserError where the task has no targets, they cannot be read, or they are of an axis that the machine has not."""
    poses = targets(task)
    if not poses:
        raise UserError(f"a task {task.task!r} has no targets; it is for move and path")
    if unknown := [axis for pose in poses for axis in pose if axis not in bench.axes]:
        raise UserError(f"{bench.machine_name} has no axis {unknown[0]!r}, only {', '.join(bench.axes)}")
