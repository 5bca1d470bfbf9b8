"""Task files that are wrong: one line that says file, key, what was expected."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from drivetwin.controller.tasks.file import read_order
from drivetwin.controller.tasks.library import task_class, task_names
from drivetwin.controller.tasks.path import Path as PathTask
from drivetwin.foundation.errors import UserError

GOOD = {"format": "task/1", "task": "path", "machine": "scara", "profile": "servoone", "parameters": {"poses": [{"lift": 0.2}]}}


def written(path: Path, **changes: Any) -> Path:
    path.write_text(json.dumps({**GOOD, **changes}), encoding="utf-8")
    return path


def test_a_task_file_is_an_order(tmp_path: Path) -> None:
    order = read_order(written(tmp_path / "task.json", cycle=0.002, seed=3, resume=True))
    assert isinstance(order.task, PathTask)
    assert order.task.poses == ({"lift": 0.2},)
    assert (order.machine.machine, order.profile.name) == ("scara", "servoone")
    assert (order.cycle, order.seed, order.resume) == (0.002, 3, True)


def test_every_task_of_the_format_is_there() -> None:
    assert set(task_names()) == {"boot", "enable", "home", "move", "path", "identify", "feed_forward", "soak", "bode"}
    for name in task_names():
        assert task_class(name).__module__ == f"drivetwin.controller.tasks.{name}"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"format": "task/2"}, r"task.json: format: Input should be 'task/1'"),
        ({"task": "dance"}, r"there is no task 'dance'; this controller can do bode, boot, enable, feed_forward, home"),
        ({"machine": "crane"}, r"knows no machine 'crane'; it knows arm, scara, stage, or give the folder of a machine"),
        ({"profile": "abc"}, r"abc"),
        ({"cycle": 0}, r"cycle: Input should be greater than 0"),
        ({"speed": 1}, r"speed: Extra inputs are not permitted"),
        ({"parameters": {}}, r"parameters of path: poses: Field required"),
        ({"parameters": {"poses": []}}, r"parameters of path: poses"),
        ({"parameters": {"poses": [{"lift": 2.0}]}}, r"lift is to go to 2, and its travel is 0.01 .. 0.34"),
        ({"parameters": {"poses": [{"hook": 0.1}]}}, r"machine scara has no axis 'hook', only lift, rotate, stretch"),
        ({"parameters": {"poses": [{"lift": "high"}]}}, r"poses.0.lift"),
        ({"task": "move", "parameters": {"moves": [{"axis": "lift", "to": 9}]}}, r"lift is to go to 9"),
        ({"task": "soak", "parameters": {"seconds": -1}}, r"parameters of soak: seconds: Input should be greater than 0"),
    ],
)
def test_what_is_wrong_is_named(changes: dict[str, Any], expected: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=expected):
        read_order(written(tmp_path / "task.json", **changes))


def test_a_file_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no task file"):
        read_order(tmp_path / "task.json")
    (tmp_path / "task.json").write_text("{", encoding="utf-8")
    with pytest.raises(UserError, match="is not JSON"):
        read_order(tmp_path / "task.json")
