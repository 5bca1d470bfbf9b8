"""A bench of the one-axis stage whose drives are not the judge's: `drivetwin emulate` in a process of its own has them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from stage_bench import bench_file

KEEPS_LIMITS = [
    *("{python}", "-m", "drivetwin.controller", "{task_file}"),
    *("--bus", "{bus}", "--clock", "{clock}", "--out", "{out}", "--limits", "{limits}", "--yes"),
]

LEISURELY = 0.02
"""s; three of these without an answer stop the controller, and a machine that also runs other tests stalls for a few ms."""

SLOWER: dict[str, Any] = {"travel": [-0.15, 0.15], "speed": 0.2, "torque": 400.0}


def real_bench(folder: Path, bus: str, **changes: Any) -> Path:
    """A bench/1 file, and the limits file beside it; `slide` are the limits of the axis, all else keys of the bench."""
    limits = {"axes": {"slide": changes.pop("slide", SLOWER)}}
    (folder / "limits.yaml").write_text(yaml.safe_dump(limits), encoding="utf-8")
    said: dict[str, Any] = {"cycle": LEISURELY, "drives": "real", "bus": bus, "clock": "realtime"}
    real = {"real": {"limits": "limits.yaml", "any_bus": True}}
    return bench_file(folder, changes.pop("command", KEEPS_LIMITS), **(said | real | changes))
