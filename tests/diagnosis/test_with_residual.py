"""What has no name as a table in the patch: the gap shrinks on motion that was not fitted, and nothing else is said."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.diagnosis.report.wording import residual_words
from drivetwin.diagnosis.report.write import write_diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.effects.residual_table import ResidualTable
from drivetwin.recording.recording import Recording, RecordingInfo

PERIOD, INERTIA, COULOMB, VISCOUS, NOISE, HUMP = 0.004, 0.5, 1.0, 0.3, 0.02, 0.6

MODEL = f"""<mujoco model="one"><option gravity="0 0 0"/><worldbody><body>
<joint name="turn" axis="0 0 1" frictionloss="{COULOMB}" damping="{VISCOUS}"/>
<inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/></body></worldbody>
<actuator><motor name="turn" joint="turn"/></actuator></mujoco>"""


def foreign(position: Array, velocity: Array) -> Array:
    """Two dry places of different width that hold back one way more than the other: no effect of the library [N·m]."""
    dry = np.exp(-(((position - 0.35) / 0.22) ** 2)) - 0.7 * np.exp(-(((position + 0.5) / 0.3) ** 2))
    return np.asarray(HUMP * dry * np.where(velocity > 0.0, 1.0, -0.5))


def recording(seed: int, seconds: float, name: str, size: float = 1.0) -> Recording:
    """Swings of many speeds over the whole travel; `size` of the foreign torque."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    parts = list(zip((0.7, 0.35, 0.1), rng.uniform([0.9, 2.2, 4.0], [1.3, 2.9, 6.0]), rng.uniform(0.0, 6.0, 3), strict=True))
    position = np.sum([a * np.sin(w * time + p) for a, w, p in parts], axis=0)
    velocity = np.sum([a * w * np.cos(w * time + p) for a, w, p in parts], axis=0)
    acceleration = np.sum([-a * w**2 * np.sin(w * time + p) for a, w, p in parts], axis=0)
    torque = INERTIA * acceleration + COULOMB * np.sign(velocity) + VISCOUS * velocity + size * foreign(position, velocity)
    torque = torque + NOISE * rng.standard_normal(len(time))
    known = {"joint": "turn", "torque_resolution": 1e-4, "position_resolution": 1e-7}
    info = RecordingInfo.model_validate(
        {"schema": "recording/1", "machine": "one", "sample_period": PERIOD, "axes": {"turn": known}}
    )
    return Recording(name, info, time, {"turn": {"position": position, "torque": torque}})


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("one") / "model.xml"
    path.write_text(MODEL, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def found(model: Path) -> Diagnosis:
    recordings = [recording(1, 30.0, "one")], [recording(2, 20.0, "two")]
    return diagnose(model, *recordings, Settings(), lambda _what, _share: None, tables=True)


def test_the_gap_of_a_foreign_cause_shrinks_on_motion_that_was_not_fitted(found: Diagnosis) -> None:
    (one,) = found.residual
    assert found.axes["turn"].unknown.share > 0.1
    assert one.gap_rms < 0.6 * found.after_rms["turn"]
    assert one.of_unknown > 0.6


def test_a_table_is_no_cause_and_no_selected_effect(found: Diagnosis) -> None:
    named = {cause.effect for cause in found.causes} | {one.effect.name for one in found.selected}
    assert "residual_table" not in named
    assert {entry.effect for entry in found.axes["turn"].not_testable}.isdisjoint({"residual_table"})


def test_the_files_have_it_and_the_figures_follow_from_them(found: Diagnosis, tmp_path: Path) -> None:
    write_diagnosis(found, [], tmp_path, html=True)
    effects = read_effects(tmp_path / "effects.json")
    assert effects == found.patch
    assert isinstance(effects[-1].effect, ResidualTable)
    told = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    table = pq.read_table(tmp_path / "prediction" / "two.parquet").to_pydict()
    used = np.array(table["turn.used"])
    left = (np.array(table["turn.torque_measured"]) - np.array(table["turn.torque_with_residual"]))[used]
    (entry,) = told["residual"]
    assert entry["gap_rms"] == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)
    assert all(one["effect"] != "residual_table" for one in [*told["selected"], *told["causes"]])
    assert "A table of what has no name" in residual_words(found)
    assert "A table of what has no name" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_table_that_makes_validation_worse_is_left_out(model: Path) -> None:
    """The dry places have become slippery ones meanwhile."""
    fitted, held = [recording(1, 30.0, "one")], [recording(2, 20.0, "two", -1.0)]
    other = diagnose(model, fitted, held, Settings(), lambda _what, _share: None, tables=True)
    assert (other.residual, other.with_residual) == ((), ())
    assert other.axes["turn"].significant


def test_without_being_asked_for_there_is_none(found: Diagnosis, tmp_path: Path) -> None:
    write_diagnosis(replace(found, residual=(), with_residual=()), [], tmp_path, html=False)
    assert "residual" not in json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    names = pq.read_table(tmp_path / "prediction" / "two.parquet").column_names
    assert not [name for name in names if name.endswith("with_residual")]
