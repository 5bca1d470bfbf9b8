"""The task that a scenario gives the controller."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from drivetwin.foundation.json_value import JsonValue
from drivetwin.foundation.typed_yaml import Strict

TaskName = Literal["boot", "enable", "home", "move", "path", "identify", "feed_forward", "soak"]


class Task(Strict):
    """A task with its parameters; `resume`: after a fault that can be reset the controller goes on."""

    task: TaskName
    parameters: dict[str, JsonValue] = Field(default_factory=dict)
    resume: bool = False
