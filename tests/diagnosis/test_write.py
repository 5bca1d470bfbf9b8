"""What a diagnosis writes, read back by others: json, Parquet, the effects' own reader, and the contract's example by hand."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from gap_bench import CAUSES, STRIBECK, axis_of, diagnosis_of, recording_of, stribeck_case, time_of
from pydantic import ValidationError

from drivetwin.diagnosis.report.result import Diagnosis, Prediction
from drivetwin.diagnosis.report.schema import GapReport, read_report
from drivetwin.diagnosis.report.write import write_diagnosis
from drivetwin.emulator.effects import read_effects
from drivetwin.foundation.errors import UserError

CASE = stribeck_case(20.0)

# contract gap-report/2, "report.json", every figure as it stands there
EXAMPLE: dict[str, Any] = json.loads("""
    {"schema": "gap-report/2", "version": "...", "inputs": {"model.xml": "ab"}, "seed": 0, "settings": {"blocks": 40},
     "verdict": "explained",
     "axes": {"rotate": {
        "cutoff_hz": 61, "standstill_velocity": 0.002,
        "torque_rms": 3.1, "gap_rms": 0.44, "noise_rms": 0.05, "model_error_rms": 0.03, "standstill_rms": 0.3,
        "significant": true, "test": {"name": "...", "p_value": 1e-9},
        "shares": [{"of": "stribeck", "share": 0.83, "ci90": [0.8, 0.86]}, {"of": "unknown", "share": 0.05, "ci90": [0.0, 0.1]},
                   {"of": "noise", "share": 0.12, "ci90": [0.1, 0.14]}],
        "where": [{"regime": "low_speed", "share": 0.71, "interval": {"velocity": [-0.1, 0.1]}},
                  {"regime": "high_speed", "share": 0.29, "interval": {"speed": [0.1, 1.0]}}],
        "where_after": [{"regime": "low_speed", "share": 1.0, "interval": {"velocity": [-0.1, 0.1]}}],
        "patterns": [{"over": "position", "share": 0.12, "detail": "period 7.2 deg"}],
        "unknown": {"share": 0.05, "goes_with": ["position"], "correlation_time": 0.2},
        "not_testable": [{"effect": "coulomb_asymmetry", "reason": "motion in one direction only",
                          "needed": "strokes backwards"}]}},
     "causes": [
        {"effect": "stribeck", "axis": "rotate", "probability": 0.97, "share": 0.83,
         "parameters": {"static_torque": {"value": 1.3, "unit": "N·m", "ci90": [1.2, 1.4]}},
         "gap_closed": {"validation": 0.97, "ci90": [0.96, 0.98], "of_explainable": 0.99},
         "indistinguishable_from": ["presliding"],
         "tell_apart_by": "slow constant-velocity sweeps below 0.05 rad/s", "or_by_sensor": "an encoder on the joint"},
        {"effect": "unknown", "axis": "rotate", "probability": 0.02, "share": 0.05, "parameters": {}, "gap_closed": null,
         "indistinguishable_from": [], "tell_apart_by": "", "or_by_sensor": ""}],
     "selected": [{"effect": "stribeck", "axis": "rotate"}],
     "after": {"rotate": {"gap_rms": 0.07}}}
""")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("gap")
    model = directory / "model.xml"
    model.write_text("<mujoco/>")
    out = directory / "out"
    out.mkdir()
    write_diagnosis(CASE, [model], out, html=False)
    return out


def keys(value: object) -> object:
    """The nesting of keys in their order; of a list its first entry's."""
    if isinstance(value, dict):
        return [(name, keys(inner)) for name, inner in value.items()]
    return [keys(value[0])] if isinstance(value, list) and value else None


def test_the_contract_s_example_is_a_report_and_comes_back_in_its_order() -> None:
    report = GapReport.model_validate(EXAMPLE)
    dumped = report.model_dump(mode="json", by_alias=True)
    assert dumped == EXAMPLE
    assert keys(dumped) == keys(EXAMPLE)


def test_report_json_has_the_contract_s_keys_in_its_order(written: Path) -> None:
    report = json.loads((written / "report.json").read_text())
    assert list(report) == list(EXAMPLE)
    assert report["settings"] == asdict(CASE.settings)
    assert list(report["axes"]) == ["rotate", "stretch"]
    example = EXAMPLE["axes"]["rotate"]
    for axis in report["axes"].values():
        assert list(axis) == list(example)
        assert list(axis["test"]) == ["name", "p_value"]
        assert all(list(regime) == ["regime", "share", "interval"] for regime in axis["where"])
        assert all(list(share) == ["of", "share", "ci90"] for share in axis["shares"])
        assert list(axis["unknown"]) == ["share", "goes_with", "correlation_time"]
        for parts in ("where", "shares"):
            assert math.fsum(each["share"] for each in axis[parts]) == pytest.approx(1.0, abs=1e-12)
    assert all(list(cause) == list(EXAMPLE["causes"][0]) for cause in report["causes"])
    assert [(cause["axis"], cause["effect"]) for cause in report["causes"]] == [(each.axis, each.effect) for each in CAUSES]


def test_figures_can_be_recomputed_from_the_parquet_to_the_last_digit(written: Path) -> None:
    report = json.loads((written / "report.json").read_text())
    table = pq.read_table(written / "prediction" / "sweep.parquet")
    axes = ("rotate", "stretch")
    assert table.column_names == ["time"] + [
        f"{axis}.{name}" for axis in axes for name in ("torque_before", "torque_after", "torque_measured", "used")
    ]
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    assert np.array_equal(columns["time"], CASE.predictions[0].time)
    for axis in axes:
        used = columns[f"{axis}.used"]
        assert used.dtype == np.bool_
        measured = columns[f"{axis}.torque_measured"][used]
        before, after = (measured - columns[f"{axis}.torque_{when}"][used] for when in ("before", "after"))
        assert report["axes"][axis]["gap_rms"] == np.sqrt(np.mean(before**2))
        assert report["after"][axis]["gap_rms"] == np.sqrt(np.mean(after**2))


def test_the_effects_are_read_by_the_emulator(written: Path) -> None:
    placed = read_effects(written / "effects.json")
    assert placed == (STRIBECK,)
    assert (written / "patched.xml").read_text() == CASE.model_xml


def test_inputs_are_named_as_given_with_their_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("model.xml").write_text("<mujoco model='a'/>")
    (tmp_path / "out").mkdir()
    write_diagnosis(CASE, [Path("model.xml")], tmp_path / "out", html=False)
    report = json.loads(Path("out/report.json").read_text())
    assert report["inputs"] == {"model.xml": hashlib.sha256(b"<mujoco model='a'/>").hexdigest()}
    assert report["seed"] == CASE.settings.seed


def test_a_prediction_of_every_validation_recording(tmp_path: Path) -> None:
    time = time_of(5.0)
    runs: tuple[Prediction, ...] = tuple(
        recording_of(time, {"rotate": axis_of(time, np.full_like(time, 0.1))}, name) for name in ("one", "two")
    )
    unknown = (replace(CAUSES[2], probability=1.0),)
    write_diagnosis(diagnosis_of(runs, (), unknown), [], tmp_path, html=False)
    assert sorted(path.name for path in (tmp_path / "prediction").iterdir()) == ["one.parquet", "two.parquet"]
    assert json.loads((tmp_path / "effects.json").read_text())["effects"] == []


def spoiled_axis(case: Diagnosis, **changes: Any) -> Diagnosis:
    return replace(case, axes={**case.axes, "rotate": replace(case.axes["rotate"], **changes)})


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda case: spoiled_axis(case, gap_rms=float("nan")), "finite number"),
        (lambda case: spoiled_axis(case, noise_rms=-1.0), "greater than or equal to 0"),
        (lambda case: spoiled_axis(case, where=case.axes["rotate"].where[1:]), "shares of `where`"),
        (lambda case: spoiled_axis(case, shares=case.axes["rotate"].shares[1:]), "shares of `shares`"),
        (lambda case: spoiled_axis(case, standstill_velocity=-0.1), "greater than or equal to 0"),
        (lambda case: replace(case, causes=(CAUSES[1], CAUSES[0], CAUSES[2])), "order of probability times share"),
        (lambda case: replace(case, causes=CAUSES[1:]), "axis rotate has a gap and no cause"),
        (lambda case: replace(case, causes=(*CAUSES, replace(CAUSES[2], axis="elbow", share=0.0))), "axis elbow"),
        (lambda case: replace(case, causes=(replace(CAUSES[0], effect="unknown"), *CAUSES[1:])), "has no parameters"),
        (lambda case: replace(case, causes=(replace(CAUSES[0], probability=1.1), *CAUSES[1:])), "less than or equal to 1"),
        (lambda case: replace(case, after_rms={"rotate": 0.1}), "not about the same axes"),
    ],
)
def test_what_breaks_the_contract_is_never_written(
    tmp_path: Path, spoil: Callable[[Diagnosis], Diagnosis], expected: str
) -> None:
    with pytest.raises(ValidationError, match=expected):
        write_diagnosis(spoil(CASE), [], tmp_path, html=False)
    assert not list(tmp_path.iterdir())


def test_an_axis_that_never_moves_has_no_standstill_velocity(tmp_path: Path) -> None:
    write_diagnosis(spoiled_axis(CASE, standstill_velocity=math.inf), [], tmp_path, html=False)
    assert json.loads((tmp_path / "report.json").read_text())["axes"]["rotate"]["standstill_velocity"] is None


def test_a_report_is_read_back(written: Path, tmp_path: Path) -> None:
    report = read_report(written / "report.json")
    assert report.axes["rotate"].gap_rms == CASE.axes["rotate"].gap_rms
    assert report.causes[0].parameters["static_torque"].ci90 == (1.2, 1.4)
    (tmp_path / "other.json").write_text(json.dumps(EXAMPLE | {"schema": "gap-report/1"}))
    with pytest.raises(UserError, match=r"other.json is not a valid gap-report/2 file: schema"):
        read_report(tmp_path / "other.json")
    with pytest.raises(UserError, match="no file"):
        read_report(tmp_path / "nowhere.json")


def test_a_key_that_the_contract_does_not_have_is_refused() -> None:
    with pytest.raises(ValidationError, match="Extra inputs"):
        GapReport.model_validate(EXAMPLE | {"colour": "red"})
