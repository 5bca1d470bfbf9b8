"""A controller in JavaScript, docs/examples/javascript_controller, on a real vcan0, judged as a user would have it judged."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from foreign import installed
from processes import DRIVETWIN

BENCH = Path(__file__).parents[2] / "docs" / "examples" / "javascript_controller" / "bench.yaml"
CASES = ("04_moves.single", "08_faults.drive_fault")

LONGEST = 900.0
"""For all cases together, on a loaded machine [s]; nothing is asserted on how long it took."""


def test_the_controller_is_accepted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It does what it is told, and stops all axes where one drive faults: by the plant's truth."""
    monkeypatch.setenv("NODE_PATH", str(installed("node_modules")))
    selected = [word for case in CASES for word in ("--select", case)]
    command = [*DRIVETWIN, "accept", "--bench", str(BENCH), *selected, "--out", str(tmp_path / "accept")]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LONGEST, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    results = json.loads((tmp_path / "accept" / "results.json").read_text(encoding="utf-8"))
    told = [(f"{one['number']:02d}_{one['group']}.{one['name']}", one["outcome"]) for one in results["cases"]]
    assert told == [(case, "accepted") for case in CASES]
