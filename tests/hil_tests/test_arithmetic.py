"""Lockstep on processors of other instructions: the same frames, motions and figures, to the last bit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from foreign import missing
from repeats import repeated
from stage_bench import bench_file, scenario_file

from drivetwin.foundation.arithmetic import children_compute_alike, common_arithmetic
from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.run import run_all
from drivetwin.hil_tests.scenario import read_scenario

PROGRAM = Path(__file__).with_name("lockstep_figures.py")

FUSES = "fma" in Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
PROCESSORS = ("SandyBridge", "Haswell") if FUSES else ("Haswell", "SandyBridge")
"""That qemu plays, the one less like this host first: AVX alone (MuJoCo needs it), and AVX2 with fused multiply-add."""

TELLS_ITS_ENVIRONMENT = ["{python}", "-c", "import json, os; print(json.dumps(dict(os.environ)))"]


def figures(*before: str, compiled_for: str | None = None) -> dict[str, str]:
    """What the program prints as a process, where `before` is what starts it; compiled for this processor or as told."""
    told = {} if compiled_for is None else {"NUMBA_CPU_NAME": compiled_for.lower(), "NUMBA_CPU_FEATURES": ""}
    with children_compute_alike():
        whole = os.environ | told
        done = subprocess.run([*before, sys.executable, PROGRAM], capture_output=True, text=True, check=False, env=whole)
    assert done.returncode == 0, done.stderr
    return dict(line.split() for line in done.stdout.splitlines())


def test_two_processors_compute_the_same_to_the_last_bit() -> None:
    qemu = shutil.which("qemu-x86_64-static") or shutil.which("qemu-x86_64")
    if qemu is None:
        missing("qemu-x86_64", "Debian package qemu-user-static")
    native = figures()
    assert sorted(native) == ["fit", "frames", "plan", "plant"]
    for processor in repeated(*PROCESSORS):
        assert figures(compiled_for=processor) == native, "compiled here: where qemu compiles, it takes five times as long"
        assert figures(qemu, "-cpu", processor, compiled_for=processor) == native, processor


def test_cases_in_lockstep_run_in_that_environment_however_many_at_once(tmp_path: Path) -> None:
    """The controller is started by the process of its case, and tells what both have."""
    bench = read_bench(bench_file(tmp_path, TELLS_ITS_ENVIRONMENT))
    case = read_scenario(scenario_file(tmp_path / "own", "04_moves/own"), bench)
    before, wanted = dict(os.environ), common_arithmetic()
    run_all(bench, [case], tmp_path / "cases", 1, lambda _: None)
    told = json.loads((tmp_path / "cases" / case.identity / "controller.log").read_text().splitlines()[0])
    assert {name: told[name] for name in wanted} == wanted
    assert dict(os.environ) == before


def test_where_every_vector_instruction_is_disabled_already_they_stay_disabled() -> None:
    """numpy leaves out what is empty of what it found: on an old processor, or as the user has it."""
    wanted = common_arithmetic()
    program = "from drivetwin.foundation.arithmetic import common_arithmetic as told; print(told()['NPY_DISABLE_CPU_FEATURES'])"
    asked = [sys.executable, "-c", program]
    done = subprocess.run(asked, capture_output=True, text=True, check=False, env=os.environ | wanted)
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) == set(wanted["NPY_DISABLE_CPU_FEATURES"].split())


def test_tunables_of_the_users_own_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GLIBC_TUNABLES", "glibc.malloc.check=3:glibc.cpu.hwcaps=-AVX2")
    tunables = common_arithmetic()["GLIBC_TUNABLES"].split(":")
    assert tunables[0] == "glibc.malloc.check=3"
    assert [one for one in tunables if one.startswith("glibc.cpu.hwcaps=")] == tunables[1:]
    assert "-FMA," in tunables[1]
