"""A task file (task/1): which machine and drives, which task with which parameters, at which cycle."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, PositiveFloat, ValidationError

from drivetwin.controller.machine import Machine, load_machine
from drivetwin.controller.tasks.base import Task
from drivetwin.controller.tasks.library import task_class
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.text_files import parse_json


class _TaskFile(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["task/1"]
    task: str
    machine: str
    profile: str
    cycle: PositiveFloat = 0.001
    seed: NonNegativeInt = 0
    resume: bool = False
    parameters: dict[str, Any] = Field(default_factory=dict)


@dataclass(frozen=True)
class Order:
    """What the controller is told: the task, on which machine with which drives; `cycle` [s] is what it is asked to run."""

    task: Task
    machine: Machine
    profile: DriveProfile
    cycle: float
    seed: int
    resume: bool

    def on(self, machine: Machine) -> Order:
        """The same order on a machine with narrower limits. Raises UserError where it cannot be done within them."""
        self.task.check(machine)
        return replace(self, machine=machine)


def read_order(path: Path) -> Order:
    """Read and check a task file.

    Raises UserError naming the file and the key for what is missing or wrong, or what the machine cannot do.
    """
    try:
        told = _TaskFile.model_validate(parse_json(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise UserError(f"no task file {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}") from None
    except json.JSONDecodeError as error:
        raise UserError(f"{path} is not JSON: {error}") from None
    except ValidationError as error:
        raise UserError(f"{path}: {_first(error)}") from None
    kind, machine = task_class(told.task), load_machine(told.machine)
    try:
        task = kind.model_validate(told.parameters)
    except ValidationError as error:
        raise UserError(f"{path}: parameters of {told.task}: {_first(error)}") from None
    task.check(machine)
    return Order(task, machine, load_profile(told.profile), told.cycle, told.seed, told.resume)


def _first(error: ValidationError) -> str:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"]) or "the file"
    return f"{where}: {first['msg']}"
