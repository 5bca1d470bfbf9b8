"""A bench of the one-axis stage, and scenarios, written where a test wants them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

BAD_CONTROLLERS = Path(__file__).with_name("bad_controllers.py")

LIMITS: dict[str, Any] = {
    "travel": {"slide": [-1.0, 1.0]},
    "speed": {"slide": 1.0},
    "torque": {"slide": 5000.0},
    "enable_jump": {"slide": 0.001},
    "homing_error": {"slide": 0.0001},
    "tracking_error": {"slide": 0.004},
    "settling_band": {"slide": 0.0001},
    "settling_time": 0.3,
    "overshoot": {"slide": 0.001},
    "stop_time": 0.5,
    "stop_speed": {"slide": 0.002},
    "disable_time": 1.2,
    "bus_load": 0.8,
    "sync_jitter": 0.01,
    "heartbeat_period": 0.2,
    "frames_per_cycle": 4,
    "apart": 0.01,
}


def bench_file(folder: Path, command: list[str], **changes: Any) -> Path:
    """A bench/1 file of the stage whose controller is `command`."""
    content = {
        "format": "bench/1",
        "machine": "stage",
        "profile": "servoone",
        "cycle": 0.002,
        "controller": {
            "name": "of the test",
            "command": command,
            "tasks": ["boot", "enable", "home", "move", "path", "soak"],
        },
        "pdo": {
            "rpdo 1": {"objects": ["6040:00:16", "60C1:01:32", "60B2:00:16"], "transmission": 1},
            "tpdo 1": {"objects": ["6041:00:16"], "transmission": 255},
            "tpdo 2": {"objects": ["6064:00:32", "21A3:00:32"], "transmission": 1},
        },
        "limits": LIMITS,
        "timeouts": {"start": 30.0, "silence": 30.0, "simulated": 60.0},
    }
    path = folder / "bench.yaml"
    path.write_text(yaml.safe_dump({**content, **changes}, sort_keys=False), encoding="utf-8")
    return path


def bad(what: str) -> list[str]:
    """The command of a controller of bad_controllers.py."""
    return ["{python}", str(BAD_CONTROLLERS), what, "{task_file}", "{bus}"]


REFERENCE = [
    *("{python}", "-m", "drivetwin.controller", "{task_file}"),
    *("--bus", "{bus}", "--clock", "{clock}", "--out", "{out}"),
]


def scenario_file(folder: Path, name: str = "04_moves/case", **changes: Any) -> Path:
    """A scenario/1 file NN_group/name.yaml below `folder`."""
    content = {
        "format": "scenario/1",
        "title": "A case of the test",
        "requirement": "What the test says.",
        "task": {"task": "boot"},
        "expect": [{"outcome": "done"}],
        "aftermath": 0.1,
    }
    path = folder / f"{name}.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump({**content, **changes}, sort_keys=False), encoding="utf-8")
    return path


