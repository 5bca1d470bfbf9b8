"""The file that tells the controller its task (task/1)."""

from __future__ import annotations

from pathlib import Path

from drivetwin.foundation.files import write_json
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.task import Task

FORMAT = "task/1"


def write_task(task: Task, bench: Bench, path: Path) -> None:
    """Write task.json for a controller of this bench."""
    payload = {
        "format": FORMAT,
        "task": task.task,
        "machine": bench.machine_place,
        "profile": bench.profile,
        "cycle": bench.cycle,
        "seed": bench.seed,
        "parameters": task.parameters,
    }
    write_json(path, payload | ({"resume": True} if task.resume else {}))
