"""What the controller is told to do, and the file that tells it (task/1)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from drivetwin.files import write_json
from hil_tests.strict import Strict

if TYPE_CHECKING:
    from hil_tests.bench import Bench

FORMAT = "task/1"

TaskName = Literal["boot", "enable", "home", "move", "path", "identify", "feed_forward", "soak"]


class Task(Strict):
    """A task with its parameters; `resume`: after a fault that can be reset the controller goes on."""

    task: TaskName
    parameters: dict[str, Any] = Field(default_factory=dict)
    resume: bool = False


def write_task(task: Task, bench: Bench, path: Path) -> None:
    """Write task.json for a controller of this bench."""
    payload = {
        "format": FORMAT,
        "task": task.task,
        "machine": bench.machine,
        "profile": bench.profile,
        "cycle": bench.cycle,
        "seed": bench.seed,
        "parameters": task.parameters,
    }
    write_json(path, payload | ({"resume": True} if task.resume else {}))
