"""The tutorial's commands as its script takes them from the page; `make tutorial` runs them, which takes minutes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
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


def test_the_stage_lacks_what_the_page_says(tmp_path: Path) -> None:
    """The commands of section 3, and the truth of the stage's emulator, which the diagnosis does not read."""
    _, _, section = PAGE.partition("## 3. ")
    lines = [line.strip() for line in section.partition("## 4. ")[0].splitlines() if line.startswith("    drivetwin ")]
    assert [line.split()[1] for line in lines] == ["identify", "diagnose"]
    for line in lines:
        command = line.replace("out/", f"{tmp_path}/").removeprefix("drivetwin ").split()
        subprocess.run([sys.executable, "-m", "drivetwin", *command], cwd=tutorial.ROOT, check=True, capture_output=True)
    truth = read_effects(tutorial.ROOT / "emulator/machines/stage/effects.json")
    found = {placed.effect.name: placed.effect for placed in read_effects(tmp_path / "stage_gap/effects.json")}
    assert set(found) == {placed.effect.name for placed in truth}
    for placed in truth:
        for one in placed.effect.parameters:
            true = getattr(placed.effect, one.name)
            assert getattr(found[placed.effect.name], one.name) == pytest.approx(true, rel=0.05), one.name


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


def identified(folder: Path, inertia: float) -> Path:
    """What following the page leaves of a carriage of 2 kg with a rotor of 1 kg, whose inertia is told."""
    (folder / "out/gantry").mkdir(parents=True)
    (folder / "out/gantry_found").mkdir()
    (folder / "out/gantry/model.xml").write_text(
        """<mujoco><worldbody><body><joint name="x" type="slide" armature="1" frictionloss="3" damping="4"/>
        <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody></mujoco>""",
        encoding="utf-8",
    )
    values = {"inertia": inertia, "coulomb": 3.0, "viscous": 4.0}
    told = {"axes": {"x": {"parameters": {name: {"value": value} for name, value in values.items()}}}}
    (folder / "out/gantry_found/identified.json").write_text(json.dumps(told), encoding="utf-8")
    return folder


def test_inertia_has_to_be_the_models_as_friction_has(tmp_path: Path) -> None:
    assert len(list(tutorial._identified("gantry", identified(tmp_path / "right", 3.05)))) == 3
    with pytest.raises(tutorial.WrongError, match=r"x: inertia 3.1, and the model has 3"):
        list(tutorial._identified("gantry", identified(tmp_path / "wrong", 3.1)))


def test_an_emulator_that_does_not_end_is_killed_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tutorial, "PATIENCE", 0.2)
    deaf = subprocess.Popen(
        ["bash", "-c", "trap '' INT; echo up; while true; do sleep 0.05; done"], stdout=subprocess.PIPE, text=True
    )
    assert deaf.stdout is not None
    assert deaf.stdout.readline() == "up\n"
    with pytest.raises(tutorial.WrongError, match="the emulator did not end within"):
        tutorial.end(deaf)
    assert deaf.poll() is not None
    deaf.stdout.close()
