"""The controller in C++ of docs/examples, compiled without a warning, goes through the judge on the embedded bus."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from stage_bench import scenario_file

from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.run import run_one
from drivetwin.hil_tests.scenario import read_scenario
from drivetwin.hil_tests.suite import CASES
from drivetwin.hil_tests.verdict import CaseResult, Outcome

EXAMPLE = Path(__file__).parents[2] / "docs/examples/cpp_controller"

COMPILER = shutil.which("g++")

pytestmark = pytest.mark.skipif(COMPILER is None, reason="there is no g++ to compile the example with")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the example, a copy, with the program in it."""
    folder = tmp_path_factory.mktemp("cpp")
    for file in EXAMPLE.iterdir():
        shutil.copy(file, folder)
    strict = ["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run([str(COMPILER), *strict, "-o", "controller", "main.cpp"], cwd=folder, check=True, timeout=120)
    return folder


Judge = Callable[[Path], CaseResult]


@pytest.fixture
def judge(built: Path, tmp_path: Path) -> Judge:
    """Runs a scenario file with the program."""

    def run(path: Path) -> CaseResult:
        bench = read_bench(built / "bench.yaml")
        return run_one(bench, read_scenario(path, bench), tmp_path / "out")

    return run


@pytest.mark.parametrize("case", ["01_boot/configured", "02_enable/enable"])
def test_it_goes_through_the_product_s_cases(judge: Judge, case: str) -> None:
    result = judge(CASES / f"{case}.yaml")
    assert result.outcome is Outcome.ACCEPTED, result.failures


ENABLED: dict[str, Any] = {"state": "operation_enabled", "node": "all"}


@pytest.mark.parametrize(
    ("fault", "node"),
    [("heartbeat_lost", 3), ("frames_lost", 1), ("sto", 2), ("node_resets", 2)],
)
def test_it_stops_every_axis_and_names_the_node(judge: Judge, tmp_path: Path, fault: str, node: int) -> None:
    struck = {"fault": fault, "node": node, "when": ENABLED, "after": 0.2}
    gone = {1: ["lift"], 2: ["rotate"], 3: ["stretch"]}[node] if fault == "frames_lost" else []
    result = judge(
        scenario_file(
            tmp_path,
            task={"task": "enable", "parameters": {"hold": 2.0}},
            faults=[struck],
            expect=[{"outcome": "stopped"}, "stopped", {"names_fault": node}, {"disabled_at_end": {"except_for": gone}}],
        )
    )
    assert result.outcome is Outcome.ACCEPTED, result.failures


def test_it_refuses_what_it_cannot_do(judge: Judge, built: Path, tmp_path: Path) -> None:
    struck = {"fault": "node_dies", "node": 3, "when": {"time": 0.0}}
    expect = [{"outcome": "refused"}, "nothing_moves", {"names_fault": 3}]
    assert judge(scenario_file(tmp_path, faults=[struck], expect=expect)).outcome is Outcome.ACCEPTED

    task = tmp_path / "task.json"
    task.write_text('{"format": "task/1", "task": "soak", "machine": "scara"}', encoding="utf-8")
    command = [str(built / "controller"), str(task), "--bus", "unix:/nowhere", "--out", str(tmp_path)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, timeout=20)
    assert ran.returncode == 2
    assert ran.stderr == "controller: this controller does boot and enable on a scara, not soak on a scara\n"
