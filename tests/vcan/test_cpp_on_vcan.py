"""The controller in C++ of docs/examples on a real vcan0: accepted, and frame by frame what it is on the embedded bus."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest
from processes import drivetwin

EXAMPLE = Path(__file__).parents[2] / "docs/examples/cpp_controller"

COMPILER = shutil.which("g++")

CASE = "02_enable.enable"


@pytest.mark.skipif(COMPILER is None, reason="there is no g++ to compile the example with")
def test_the_bus_makes_no_difference(tmp_path: Path) -> None:
    folder = tmp_path / "example"
    shutil.copytree(EXAMPLE, folder)
    subprocess.run([str(COMPILER), "-std=c++17", "-o", "controller", "main.cpp"], cwd=folder, check=True, timeout=300)
    embedded = (folder / "bench.yaml").read_text(encoding="utf-8")
    digests, logs = set(), []
    for bus in ("embedded", "vcan0"):
        bench, out = folder / f"{bus}.yaml", tmp_path / bus
        bench.write_text(embedded.replace("bus: embedded", f"bus: {bus}", 1), encoding="utf-8")
        done = drivetwin("accept", "--bench", bench, "--select", CASE, "--out", out)
        assert (done.status, done.err) == (0, ""), done.out
        results = json.loads((out / "results.json").read_text(encoding="utf-8"))
        assert results["bench"]["bus"] == bus
        assert [case["outcome"] for case in results["cases"]] == ["accepted"]
        digests.add(results["digest"])
        logs.append((out / "cases" / CASE / "bus.log").read_text(encoding="ascii").splitlines())
    assert logs[0] == logs[1]
    assert len(digests) == 1
