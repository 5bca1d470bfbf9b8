"""A claim to be indistinguishable from a true effect is tried by the fit: what truly is counts, what is not does not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drivetwin.blind.alike import Checked, Material, alike_payload, checked
from drivetwin.blind.answer import ALIKE, read_answer
from drivetwin.blind.case import Case, Cause
from drivetwin.blind.claims import Claim
from drivetwin.emulator.effects import Effect, PlacedEffect
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.file import effects_payload
from drivetwin.emulator.effects.viscous_asymmetry import ViscousAsymmetry
from drivetwin.foundation.files import write_json
from drivetwin.recording.recording import Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

PERIOD, INERTIA, COULOMB, VISCOUS, OFFSET, NOISE = 0.004, 0.5, 1.0, 0.3, 0.4, 0.02

MODEL = f"""<mujoco><option gravity="0 0 0"/><worldbody><body>
<joint name="turn" axis="0 0 1" frictionloss="{COULOMB}" damping="{VISCOUS}"/>
<inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/></body></worldbody>
<actuator><motor name="turn" joint="turn"/></actuator></mujoco>"""

TRUTH = Cause("torque_offset", "turn", {"offset": -OFFSET})


def recording(folder: Path, name: str, way: float, seed: int) -> Path:
    """One direction at speeds from 0.4 to 2.6 rad/s, never near a standstill; the drive's torque has an offset."""
    draw = np.random.default_rng(seed)
    time = np.arange(0.0, 12.0, PERIOD)
    slow, fast = draw.uniform(0.8, 1.2), draw.uniform(2.0, 3.0)
    velocity = way * (1.5 + 0.8 * np.sin(slow * time) + 0.3 * np.sin(fast * time))
    acceleration = way * (0.8 * slow * np.cos(slow * time) + 0.3 * fast * np.cos(fast * time))
    position = way * (1.5 * time - 0.8 / slow * np.cos(slow * time) - 0.3 / fast * np.cos(fast * time))
    torque = INERTIA * acceleration + COULOMB * way + VISCOUS * velocity + OFFSET + NOISE * draw.standard_normal(len(time))
    known = {"joint": "turn", "torque_resolution": 1e-4, "position_resolution": 1e-7}
    info = RecordingInfo.model_validate(
        {"schema": "recording/1", "machine": "one", "sample_period": PERIOD, "axes": {"turn": known}}
    )
    write_recording(Recording(name, info, time, {"turn": {"position": position, "torque": torque}}), folder / name)
    return folder / name


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Path], list[Path]]:
    """Forwards and backwards, to fit and to validate."""
    folder = tmp_path_factory.mktemp("recordings")
    names = [("there", 1.0, 1), ("back", -1.0, 2), ("again", 1.0, 3), ("home", -1.0, 4)]
    paths = [recording(folder, *each) for each in names]
    return paths[:2], paths[2:]


def tried(folder: Path, recordings: tuple[list[Path], list[Path]], chosen: Effect, unit: str, truth: Cause) -> Checked:
    """The one claim of an answer that has selected `chosen`."""
    (folder / "patched.xml").write_text(MODEL, encoding="utf-8")
    (only,) = type(chosen).parameters
    write_json(folder / "effects.json", effects_payload([PlacedEffect("turn", chosen, {only.name: unit})]))
    axis = {"gap_rms": OFFSET, "noise_rms": NOISE, "significant": True, "cutoff_hz": 20.0}
    cause = {"effect": chosen.name, "axis": "turn", "probability": 0.9, "indistinguishable_from": [truth.effect]}
    report = {"schema": "gap-report/2", "verdict": "explained", "axes": {"turn": axis}, "causes": [cause]}
    write_json(folder / "report.json", {**report, "selected": [{"effect": chosen.name, "axis": "turn"}]})
    case = Case(0, 0, "one", "single", (truth,), "by hand")
    material = Material(folder / "patched.xml", *recordings, folder / "effects.json", folder / "report.json")
    (found,) = checked(case, [Claim(chosen.name, "turn", truth.effect)], material)
    write_json(folder / ALIKE, alike_payload([found]))
    return found


def test_an_offset_and_another_friction_in_each_direction_are_one_where_nothing_stands(
    tmp_path: Path, recordings: tuple[list[Path], list[Path]]
) -> None:
    found = tried(tmp_path, recordings, CoulombAsymmetry(OFFSET), "N·m", TRUTH)
    assert found.truth_leaves == pytest.approx(found.chosen_leaves, abs=0.002)
    assert found.holds
    assert read_answer(tmp_path).alike == {("coulomb_asymmetry", "turn", "torque_offset")}


def test_what_explains_less_than_the_true_effect_does_not_count(
    tmp_path: Path, recordings: tuple[list[Path], list[Path]]
) -> None:
    found = tried(tmp_path, recordings, ViscousAsymmetry(0.25), "N·m·s/rad", TRUTH)
    assert found.truth_leaves is not None
    assert found.truth_leaves < found.chosen_leaves - 0.05
    assert not found.holds
    answer = read_answer(tmp_path)
    assert (answer.alike, answer.checked) == (frozenset(), 1)


def test_a_true_effect_that_would_leave_more_does_not_count(
    tmp_path: Path, recordings: tuple[list[Path], list[Path]]
) -> None:
    """As if the key said viscous asymmetry: with that in its place the fit is worse."""
    found = tried(tmp_path, recordings, CoulombAsymmetry(OFFSET), "N·m", Cause("viscous_asymmetry", "turn", {"asymmetry": 0.2}))
    assert found.truth_leaves is not None
    assert found.truth_leaves > found.chosen_leaves + 0.05
    assert not found.holds


def test_what_cannot_be_fitted_does_not_count_and_says_why(
    tmp_path: Path, recordings: tuple[list[Path], list[Path]]
) -> None:
    found = tried(tmp_path, recordings, CoulombAsymmetry(OFFSET), "N·m", Cause("torque_saturation", "turn", {"limit": 9.0}))
    assert not found.holds
    assert json.loads((tmp_path / ALIKE).read_text(encoding="utf-8"))["claims"][0]["why"] == "not told by a motion"
