"""`drivetwin accept` and the pytest plugin as a CI runs them: exit status, files, the same bytes twice."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import psutil
import pytest
from processes import PATIENCE, Ended, drivetwin, start
from stage_bench import REFERENCE, bad, bench_file, scenario_file

from drivetwin.cli.accept import accept_command
from drivetwin.foundation.arithmetic import common_arithmetic
from drivetwin.foundation.errors import UserError

MOVES = {"task": "move", "parameters": {"dwell": 0.3, "moves": [{"axis": "slide", "to": 0.1}, {"axis": "slide", "to": -0.05}]}}
SOUND = ["final_position", "homed", "tracking_error", "settling", "limits", "disabled_at_end", {"outcome": "done"}]


def accept(bench: Path, out: Path, *arguments: object) -> Ended:
    return drivetwin("accept", "--bench", bench, "--out", out, "--jobs", 1, *arguments)


def test_a_sound_controller_is_accepted_with_the_same_bytes_twice(tmp_path: Path) -> None:
    bench = bench_file(tmp_path, REFERENCE)
    scenario_file(tmp_path / "own", "04_moves/to_and_fro", task=MOVES, expect=SOUND)
    own = ("--cases", tmp_path / "own", "--select", "01_boot.configured", "--select", "04_moves.to_and_fro")
    results = []
    for number in (1, 2):
        done = accept(bench, tmp_path / f"out{number}", *own)
        assert (done.status, done.err) == (0, ""), done.out
        assert "04_moves.to_and_fro" in done.out
        results.append((tmp_path / f"out{number}" / "results.json").read_bytes())
    assert results[0] == results[1]
    one, two = ((tmp_path / f"out{number}" / "report.html").read_text(encoding="utf-8") for number in (1, 2))
    assert one == two.replace("out2", "out1")
    read = json.loads(results[0])
    assert [(case["group"], case["outcome"]) for case in read["cases"]] == [("boot", "accepted"), ("moves", "accepted")]
    assert "report.html" in {path.name for path in (tmp_path / "out1").iterdir()}
    suites = ET.parse(tmp_path / "out1" / "junit.xml").getroot()
    assert (suites.get("tests"), suites.get("failures")) == ("2", "0")


def test_a_controller_that_does_nothing_is_rejected_and_the_requirement_named(tmp_path: Path) -> None:
    bench = bench_file(tmp_path, bad("does_nothing"))
    scenario_file(tmp_path / "own", "04_moves/to_and_fro", task=MOVES, expect=SOUND)
    done = accept(bench, tmp_path / "out", "--cases", tmp_path / "own", "--select", "04_moves.to_and_fro")
    assert done.status == 1
    assert "the machine never stood at slide 0.1 m" in done.out
    assert (tmp_path / "out" / "cases" / "04_moves.to_and_fro" / "bus.log").exists()


def test_results_are_the_last_that_is_written(tmp_path: Path) -> None:
    """So a folder that has them is complete: here the page cannot be written."""
    bench, page = bench_file(tmp_path, REFERENCE), tmp_path / "page"
    page.mkdir()
    done = accept(bench, tmp_path / "out", "--select", "01_boot.configured", "--html", page)
    assert done.status == 2
    assert f"{page} is not a regular file" in done.err
    assert not (tmp_path / "out" / "results.json").exists()


def test_nothing_of_a_run_that_is_killed_lives_on(tmp_path: Path) -> None:
    """Two cases at once, each with a controller that waits for good."""
    waits = ["{python}", "-c", "import time; time.sleep(600)"]
    bench = bench_file(tmp_path, waits, timeouts={"start": 600.0, "silence": 600.0, "simulated": 60.0})
    for name in ("one", "two"):
        scenario_file(tmp_path / "own", f"04_moves/{name}")
    own = ("--cases", tmp_path / "own", "--select", "04_moves.one", "--select", "04_moves.two")
    process = start("accept", "--bench", bench, "--out", tmp_path / "out", "--jobs", 2, *own)
    of_run = psutil.Process(process.pid)
    while sum(waits[-1] in each.cmdline() for each in of_run.children(recursive=True)) < 2:
        assert process.poll() is None
        time.sleep(0.1)
    children = of_run.children(recursive=True)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    _, living = psutil.wait_procs(children, timeout=PATIENCE)
    assert living == []


def test_what_others_wrote_is_told_as_they_wrote_it(tmp_path: Path) -> None:
    """Brackets are no markup: neither in the last words of a controller nor in the title of a case."""
    bench = bench_file(tmp_path, bad("stops_with_brackets"))
    scenario_file(tmp_path / "own", "04_moves/own", title="[red] [/x] :bus:")
    done = accept(bench, tmp_path / "out", "--cases", tmp_path / "own", "--select", "04_moves.own")
    assert (done.status, done.err) == (1, "")
    assert "it said: [error] :warning: [/home/u/axes.cpp:88] bus off" in done.out
    assert "[red] [/x] :bus:" in done.out


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"bench": Path("nowhere.yaml")}, "nowhere.yaml does not exist"),
        ({"clock": "sundial"}, "unknown clock 'sundial'; expected sync or realtime"),
        ({"select": ["99"]}, "--select 99 names no case"),
        ({"baseline": Path("nowhere.json")}, "no file nowhere.json"),
        ({}, "holds files that drivetwin did not write"),
    ],
)
def test_what_is_wrong_is_told_before_anything_runs(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.tex").write_text("mine")
    with pytest.raises(UserError, match=said):
        accept_command(**{"bench": bench_file(tmp_path, REFERENCE), "out": out, **changes})
    assert [path.name for path in out.iterdir()] == ["thesis.tex"]


OWN_TEST = """
import can

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.verdict import Outcome


def send(bus, cob_id, data):
    bus.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))


def test_my_own_master(bench, bus, drives, plant_truth, bus_log):
    assert bench.axes == ("slide",)
    send(bus, 0x000, b"\\x01\\x00")
    for word in (6, 7, 15):
        send(bus, 0x201, word.to_bytes(2, "little"))
        send(bus, 0x080, b"")
    assert plant_truth.state("slide") is drives[0].machine.state is State.OPERATION_ENABLED
    assert len(plant_truth.truth().time) == 3
    assert [frame.identifier for frame in bus_log if frame.by_controller] == [0x000, *[0x201, 0x080] * 3]


def test_my_own_case(run_scenario, pytestconfig):
    result = run_scenario(pytestconfig.rootpath / "own" / "01_boot" / "mine.yaml")
    assert result.outcome is Outcome.ACCEPTED
"""


def pytest_on(folder: Path, *arguments: object) -> Ended:
    """pytest with the plugin, in a project of its own."""
    installed = any(point.name == "drivetwin" for point in entry_points(group="pytest11"))
    plugin = [] if installed else ["-p", "drivetwin.hil_tests.pytest_plugin"]
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *plugin, "-rs", "-v"]
    done = subprocess.run(
        [*command, *map(str, arguments)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    return Ended(done.returncode, done.stdout, done.stderr)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "test_own.py").write_text(OWN_TEST)
    bench_file(tmp_path, bad("does_nothing"))
    scenario_file(tmp_path / "own", "01_boot/mine", expect=[{"outcome": "done"}])
    scenario_file(tmp_path / "own", "04_moves/needs_more", task=MOVES, expect=SOUND)
    return tmp_path


def test_the_plugin_runs_own_tests_and_own_cases(project: Path) -> None:
    done = pytest_on(project, "--bench", "bench.yaml", "test_own.py", "own")
    assert "3 passed" in done.out
    assert "1 failed" in done.out
    assert "04_moves.needs_more FAILED" in done.out
    assert "the machine never stood at slide 0.1 m" in done.out
    assert done.status == 1


def test_the_plugin_runs_cases_in_lockstep_in_the_common_arithmetic(tmp_path: Path) -> None:
    """As `drivetwin accept` does: the controller is started by the process of its case, and tells what both have."""
    bench_file(tmp_path, ["{python}", "-c", "import json, os; print(json.dumps(dict(os.environ)))"])
    own = scenario_file(tmp_path / "own", "04_moves/own")
    runs_it = f"from pathlib import Path\ndef test_it(run_scenario):\n    run_scenario(Path({str(own)!r}))\n"
    (tmp_path / "test_own.py").write_text(runs_it)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    pytest_on(tmp_path, "--bench", "bench.yaml", "--basetemp", "temporary", "test_own.py", "own")
    logs = sorted(tmp_path.rglob("controller.log"))
    assert len(logs) == 2, "of the case, and of the test's own run of it"
    wanted = common_arithmetic()
    for log in logs:
        told = json.loads(log.read_text(encoding="utf-8").splitlines()[0])
        assert {name: told[name] for name in wanted} == wanted


def test_the_plugin_brings_the_products_cases_where_no_files_are_named(project: Path) -> None:
    done = pytest_on(project, "--bench", "bench.yaml", "--collect-only", "-q")
    assert "05_paths.square" in done.out
    assert "test_my_own_master" in done.out


def test_the_plugin_tells_what_is_wrong_with_a_bench_or_a_case(project: Path) -> None:
    assert "nowhere.yaml does not exist" in pytest_on(project, "--bench", "nowhere.yaml").err
    scenario_file(project / "own", "04_moves/wrong", expect=["hartbeat"])
    assert "'hartbeat' is not an expectation" in pytest_on(project, "--bench", "bench.yaml", "own").out


def test_without_a_bench_the_plugin_leaves_pytest_alone(project: Path) -> None:
    done = pytest_on(project, "own")
    assert "collected 0 items" in done.out
