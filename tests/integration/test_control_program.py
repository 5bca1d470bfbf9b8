"""`python -m drivetwin.controller` as a process: exit status, controller.json, one line on stderr, the log of a failed run."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import can
import pytest
from processes import PATIENCE, emulator

CONTROL = [sys.executable, "-m", "drivetwin.controller"]


def task_file(folder: Path, task: str, **parameters: Any) -> Path:
    path = folder / "task.json"
    told = {"format": "task/1", "task": task, "machine": "stage", "profile": "servoone", "parameters": parameters}
    path.write_text(json.dumps(told), encoding="utf-8")
    return path


def start(*arguments: object) -> subprocess.Popen[str]:
    return subprocess.Popen([*CONTROL, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def run(*arguments: object) -> tuple[int, str]:
    """Exit status and stderr."""
    process = start(*arguments)
    _, err = process.communicate(timeout=PATIENCE)
    return process.returncode, err


def test_a_task_on_a_bus(tmp_path: Path) -> None:
    task = task_file(tmp_path, "move", moves=[{"axis": "slide", "to": 0.1}])
    with emulator("--machine", "stage", "--clock", "sync") as bus:
        assert run(task, "--bus", bus, "--out", tmp_path / "out") == (0, "")
        again = run(task, "--bus", bus, "--out", tmp_path / "out")
    assert again == (0, "")
    told = json.loads((tmp_path / "out" / "controller.json").read_text(encoding="utf-8"))
    assert (told["format"], told["outcome"], told["reason"], told["node"]) == ("controller/1", "done", "", None)
    assert told["cycle"] == 0.001


def test_a_wrong_configuration_is_refused_and_its_log_is_there(tmp_path: Path) -> None:
    task = task_file(tmp_path, "boot")
    with emulator("--machine", "arm", "--clock", "sync") as bus:
        status, err = run(task, "--bus", bus, "--out", tmp_path / "out", "--log", tmp_path / "bus.log")
    assert status == 2
    assert err.startswith("drivetwin-control: axis slide (node 1) has motor inertia")
    assert err.count("\n") == 1
    told = json.loads((tmp_path / "out" / "controller.json").read_text(encoding="utf-8"))
    assert told["outcome"] == "refused"
    assert err == f"drivetwin-control: {told['reason']}\n"
    assert len(list(can.CanutilsLogReader(tmp_path / "bus.log"))) > 50


def test_ctrl_c_stops_the_axes(tmp_path: Path) -> None:
    task = task_file(tmp_path, "soak", seconds=1000.0)
    with emulator("--machine", "stage", "--clock", "sync") as bus:
        process = start(task, "--bus", bus, "--out", tmp_path / "out", "--log", tmp_path / "bus.log")
        while not _moves(tmp_path / "bus.log"):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert err == "drivetwin-control: interrupted; every axis was stopped and is without voltage\n"


def _moves(log: Path) -> bool:
    """Whether the log, so far as it is written, has set-points."""
    return log.exists() and " 201#1F" in log.read_text(encoding="ascii")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("no.json", "--bus", "vcan0", "--out", "OUT"), "no task file no.json"),
        (("TASK", "--bus", "inproc", "--out", "OUT"), "inproc"),
        (
            ("TASK", "--bus", "vcan0", "--clock", "fast", "--out", "OUT"),
            "unknown clock 'fast'; expected sync or realtime or paced",
        ),
        (("TASK", "--bus", "can0", "--out", "OUT"), "can0 may be a real machine"),
        (("TASK", "--bus", "can0", "--clock", "realtime", "--out", "OUT"), "give --limits FILE, and --yes"),
        (("TASK", "--out", "OUT"), "--bus"),
        ((), "see: python -m drivetwin.controller --help"),
    ],
)
def test_wrong_input_is_one_line(arguments: tuple[str, ...], expected: str, tmp_path: Path) -> None:
    places = {"TASK": str(task_file(tmp_path, "boot")), "OUT": str(tmp_path / "out")}
    status, err = run(*(places.get(argument, argument) for argument in arguments))
    assert status == 2
    assert err.startswith("drivetwin-control: ")
    assert expected in err
    assert err.count("\n") == 1


def test_help_shows_an_example() -> None:
    done = subprocess.run([*CONTROL, "--help"], capture_output=True, text=True, check=True, timeout=PATIENCE)
    assert "Example: python -m drivetwin.controller task.json" in " ".join(done.stdout.split())


def test_nothing_heavy_is_loaded_for_a_task_that_needs_it_not() -> None:
    """It starts often, and fast."""
    code = "import sys, drivetwin.controller.__main__, drivetwin.controller.tasks.path; print(*sorted(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=PATIENCE)
    heavy = {"mujoco", "scipy", "plotly", "matplotlib", "pyarrow", "numba", "drivetwin.emulator"}
    assert not heavy & set(loaded.stdout.split())
