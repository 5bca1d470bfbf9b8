"""The tutorial's commands as its script takes them from the page; `make tutorial` runs them, which takes minutes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import tutorial

from drivetwin.cli.commands import COMMANDS
from drivetwin.emulator.effects import read_effects

PAGE = tutorial.PAGE.read_text(encoding="utf-8")
STEPS = ("machine", "emulate", "identify", "diagnose", "apply", "replay", "snapshot", "accept")


@pytest.mark.parametrize("machine", tutorial.MACHINES)
def test_the_script_finds_every_step_on_the_page(machine: str) -> None:
    lines = tutorial.commands(PAGE, machine)
    called = [line.split()[1] for line in lines if line.startswith("drivetwin ")]
    assert set(called) == set(STEPS) <= set(COMMANDS)
    assert not [line for line in lines if line.endswith("\\") or "  " in line]
    assert all(machine in line for line in lines)


@pytest.mark.parametrize("machine", tutorial.MACHINES)
def test_the_files_that_the_page_names_are_there(machine: str) -> None:
    named = {path for line in tutorial.commands(PAGE, machine) for path in re.findall(r"docs/\S+", line)}
    assert named == {f"docs/examples/{machine}/{machine}.xml", f"docs/examples/{machine}/hidden.json"}
    assert all((tutorial.ROOT / path).is_file() for path in named)
    hidden = read_effects(tutorial.ROOT / f"docs/examples/{machine}/hidden.json")
    assert {placed.effect.name for placed in hidden} == {"torque_ripple"} | ({"backlash"} if machine == "gantry" else set())


def test_a_step_that_fails_ends_it(tmp_path: Path) -> None:
    with pytest.raises(tutorial.WrongError, match="exit status 3: exit 3"):
        tutorial.follow(["true", "exit 3", "touch never"], tmp_path)
    assert not (tmp_path / "never").exists()


def test_what_was_hidden_has_to_be_found(tmp_path: Path) -> None:
    (tmp_path / "docs/examples/gantry").mkdir(parents=True)
    (tmp_path / "out/gantry_gap").mkdir(parents=True)
    hidden = {"effects": [{"effect": "backlash", "axis": "y"}]}
    (tmp_path / "docs/examples/gantry/hidden.json").write_text(json.dumps(hidden), encoding="utf-8")
    report = {"verdict": "explained", "selected": [{"effect": "delay", "axis": "y"}]}
    (tmp_path / "out/gantry_gap/report.json").write_text(json.dumps(report), encoding="utf-8")
    with pytest.raises(tutorial.WrongError, match=r"hidden and not found: \[\('backlash', 'y'\)\]"):
        list(tutorial._found("gantry", tmp_path))
