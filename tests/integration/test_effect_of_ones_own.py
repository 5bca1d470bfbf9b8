"""The effect of one's own in docs/effects.md, as it is printed there: in a file outside the product, found by every command."""

from __future__ import annotations

import json
import re
import sys
from functools import partial
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from brief_case import record_briefly
from processes import emulator
from repeats import LONG

from drivetwin.blind.case import Case
from drivetwin.blind.draw import draw_cases
from drivetwin.blind.machines import draw_machine
from drivetwin.blind.task import Procedure
from drivetwin.cli import main
from drivetwin.diagnosis.report.schema import read_report
from drivetwin.emulator.conformance import findings
from drivetwin.emulator.effects import add_effects, library, read_effect_file, read_effects
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

DOCUMENT = Path(__file__).parents[2] / "docs" / "effects.md"
LINES = 60
FIRST_SEED = 214
"""Of a blind test that draws the brake now; where draws change, the next one that does is found."""
PERIOD = 1e-3
PEAK, SPEED = 0.9, 0.6
"""Of the brake that the recorded machine has [N·m, rad/s]."""

MODEL = """<mujoco model="table"><option gravity="0 0 0"/><worldbody><body name="table">
<joint name="rotate" type="hinge" axis="0 0 1" armature="0.2" frictionloss="0.5" damping="0.1"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
<actuator><motor name="rotate" joint="rotate"/></actuator></mujoco>"""


pytestmark = pytest.mark.usefixtures("library_as_it_was")


@pytest.fixture
def brake(tmp_path: Path) -> Path:
    """The document's example, in a file."""
    (code,) = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)
    assert len(code.splitlines()) <= LINES
    path = tmp_path / "eddy_brake.py"
    path.write_text(code, encoding="utf-8")
    return path


def run(*arguments: object) -> None:
    """A command line in this process, which has to end well."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["drivetwin", *map(str, arguments)])
        main()


def recorded(folder: Path, seconds: float, frequency: float, seed: int) -> Path:
    """A table with the brake, and all else as the model has it; by the brake's formula, not by its code."""
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    angle = 2.0 * np.pi * frequency * time
    position = 0.35 * np.sin(angle) + 0.65 * np.sin(0.31 * angle + 1.0)
    velocity = np.gradient(position, PERIOD)
    drag = 2.0 * PEAK / (SPEED / velocity + velocity / SPEED)
    torque = 0.3 * np.gradient(velocity, PERIOD) + 0.1 * velocity + 0.5 * np.sign(velocity) + drag
    torque += 0.01 * np.random.default_rng(seed).standard_normal(len(time))
    axis = AxisInfo(joint="rotate", actuator="rotate", position_resolution=1e-7, torque_resolution=1e-3)
    info = RecordingInfo(machine="table", sample_period=PERIOD, axes={"rotate": axis})
    write_recording(Recording(folder.name, info, time, {"rotate": {"torque": torque, "position": position}}), folder)
    return folder


def shows_a_brake(case: Case) -> bool:
    """Whether its one effect is a brake whose peak is well within the speeds of a machine of one axis."""
    if [cause.effect for cause in case.causes] != ["eddy_brake"]:
        return False
    axes = draw_machine(case.machine, case.seed).axes
    (cause,) = case.causes
    return len(axes) == 1 and 0.15 < cause.parameters["speed"] / axes[cause.axis].max_speed < 0.5


def test_it_conforms(brake: Path) -> None:
    add_effects([read_effect_file(brake)])
    found = findings(library()["eddy_brake"])
    print(*found, sep="\n")
    assert [str(one) for one in found if not one.holds] == []


def test_a_diagnosis_finds_it_and_an_excitation_tells_it_apart(brake: Path, tmp_path: Path) -> None:
    model, out = tmp_path / "model.xml", tmp_path / "out"
    model.write_text(MODEL, encoding="utf-8")
    fitted, held = recorded(tmp_path / "fitted", 20.0, 0.25, 1), recorded(tmp_path / "held", 8.0, 0.4, 2)
    run("diagnose", model, fitted, "--validate", held, "--out", out, "--effects-from", brake, "--no-html")
    report = read_report(out / "report.json")
    first = report.causes[0]
    assert (first.effect, first.axis) == ("eddy_brake", "rotate")
    assert first.parameters["peak"].value == pytest.approx(PEAK, rel=0.02)
    assert first.parameters["speed"].value == pytest.approx(SPEED, rel=0.02)
    assert any(name.endswith(brake.name) for name in report.inputs)
    assert [one.effect.name for one in read_effects(out / "effects.json")] == ["eddy_brake"]

    unsure = json.loads((out / "report.json").read_text(encoding="utf-8"))
    unsure["causes"][0]["probability"] = 0.6
    (tmp_path / "unsure.json").write_text(json.dumps(unsure), encoding="utf-8")
    limits = tmp_path / "limits.yaml"
    limits.write_text("axes: {rotate: {travel: [-1.0, 1.0], speed: 1.0, acceleration: 4.0, jerk: 80.0}}", encoding="utf-8")
    asked = ("--report", tmp_path / "unsure.json", "--axis", "rotate", "--limits", limits)
    run("excite", model, *asked, "--out", tmp_path / "motion", "--effects-from", brake)
    motion = json.loads((tmp_path / "motion" / "motion.json").read_text(encoding="utf-8"))
    assert motion["tells_apart"] == ["eddy_brake"]
    assert [passage["name"] for passage in motion["passages"]] == ["slow_strokes", "speed_levels"]


def test_an_emulator_has_it(brake: Path, tmp_path: Path) -> None:
    truth = tmp_path / "truth.json"
    values = {"peak": {"value": 0.4, "unit": "N·m"}, "speed": {"value": 0.5, "unit": "rad/s"}}
    effect = {"effect": "eddy_brake", "axis": "shoulder", "parameters": values}
    truth.write_text(json.dumps({"schema": "effects/1", "effects": [effect]}), encoding="utf-8")
    with emulator("--machine", "arm", "--truth", truth, "--effects-from", brake):
        pass


def test_a_blind_test_draws_it_and_finds_it(brake: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One case, of a seed that draws it; its worker and its diagnosing process are processes of their own.

    Its motion is short, and as long as a user's in `make test-long`.
    """
    if not LONG:
        monkeypatch.setattr("drivetwin.cli.blind.Procedure", partial(Procedure, record=record_briefly))
    add_effects([read_effect_file(brake)])
    seed = next(seed for seed in count(FIRST_SEED) if shows_a_brake(draw_cases(1, seed)[0]))
    asked = ("--cases", 1, "--seed", seed, "--nominal", "exact", "--workers", 1)
    run("blind", "--generator", "bus", *asked, "--effects-from", brake, "--out", tmp_path / "blind")
    (case,) = json.loads((tmp_path / "blind" / "key.json").read_text(encoding="utf-8"))["cases"]
    assert case["causes"][0]["effect"] == "eddy_brake"
    first = read_report(tmp_path / "blind" / "cases" / "000" / "exact" / "report.json").causes[0]
    assert (first.effect, first.axis) == ("eddy_brake", case["causes"][0]["axis"])
