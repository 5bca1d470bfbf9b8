"""The score of wide cases on reports of gap-report/2 made by hand: each strict figure, and a run with a stand-in recorder."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from drivetwin.blind.answer import Answer, Gap, read_answer
from drivetwin.blind.case import Case, Kind
from drivetwin.blind.claims import Claim, claims
from drivetwin.blind.cluster import cluster
from drivetwin.blind.judge import Judged
from drivetwin.blind.place import Place
from drivetwin.blind.rates import Rate
from drivetwin.blind.run import Order, run
from drivetwin.blind.strict import Strict, or_alike, strict
from drivetwin.blind.task import Layout, Procedure
from drivetwin.blind.told import Told, told
from drivetwin.blind.wide.case import Item, Level, WideCase

AXES = ("x", "y", "z", "c")


def item(effect: str, axis: str = "x", size: float = 0.1, share: float = 0.8, **parameters: float) -> Item:
    return Item(effect, axis, parameters, size, share)


STRIBECK = item("stribeck", static_torque=1.3, stribeck_velocity=0.02, exponent=1.4)
RIPPLE = item("torque_ripple", "y", share=0.5, amplitude=0.4, order=6.0, phase=3.0)


def case(*causes: Item, kind: Kind = "single", nuisances: tuple[Item, ...] = ()) -> WideCase:
    levels = {axis: Level(1.0, 0.1, 0.01) for axis in AXES}
    return WideCase(
        number=0,
        seed=1,
        machine="scara",
        kind=kind,
        causes=causes,
        formulation="gms",
        axes=AXES,
        friction=("gms",) * len(AXES),
        drive="pid",
        nuisances=nuisances,
        levels=levels,
        attempt=0,
        slower=1.0,
        micro=(1e-4,) * len(AXES),
        noise=(0.0,) * len(AXES),
    )


def cause(effect: str, axis: str = "x", p: float = 1.0, share: float = 0.8, **more: Any) -> dict[str, Any]:
    return {"effect": effect, "axis": axis, "probability": p, "share": share, **more}


def estimate(low: float, high: float) -> dict[str, Any]:
    return {"value": (low + high) / 2.0, "unit": "1", "ci90": [low, high]}


def report(
    *causes: dict[str, Any], selected: tuple[tuple[str, str], ...] = (), verdict: str = "explained", **shares: float
) -> Told:
    """`shares` are of axis x."""
    level = {"torque_rms": 1.0, "gap_rms": 0.1, "noise_rms": 0.01, "significant": True}
    parts = [{"of": name, "share": share, "ci90": [share, share]} for name, share in shares.items()]
    return told(
        {
            "schema": "gap-report/2",
            "verdict": verdict,
            "axes": {axis: {**level, "shares": parts if axis == "x" else []} for axis in AXES},
            "causes": list(causes),
            "selected": [{"effect": effect, "axis": axis} for effect, axis in selected],
        }
    )


def judged(truth: Case, given: Told | None, nominal: str = "exact", /, **gaps: Gap) -> Judged:
    return Judged(truth, Answer(given, gaps, {}, None if given else "died"), nominal)


def by_the_fit(one: Judged, *alike: tuple[str, str, str]) -> Judged:
    """The same, the fit having shown of these (effect, axis, true effect) that they are indistinguishable."""
    return replace(one, answer=replace(one.answer, alike=frozenset(alike), checked=len(alike)))


def scored(*those: Judged) -> Strict:
    return strict(those)


def test_first_answer_counts_itself_or_apart_as_indistinguishable() -> None:
    alike = cause("coulomb", indistinguishable_from=["stribeck"])
    found = scored(
        judged(case(STRIBECK), report(cause("stribeck"))),
        by_the_fit(judged(case(STRIBECK), report(alike)), ("coulomb", "x", "stribeck")),
        judged(case(STRIBECK), report(alike)),
        judged(case(STRIBECK), report(cause("coulomb"))),
        judged(case(STRIBECK), report(cause("stribeck", "y"))),
        judged(case(STRIBECK), None),
    )
    assert (found.exact_first, found.alike_first) == (Rate(1, 6), Rate(1, 6))


def test_probabilities_and_what_is_selected_are_held_to_the_event_of_the_contract_as_well() -> None:
    """Two answers say that they cannot be told from the true effect; of one of them the fit says so too, one was not tried."""
    alike = cause("coulomb", p=0.9, indistinguishable_from=["stribeck"])
    named = judged(case(STRIBECK), report(alike, selected=(("coulomb", "x"),)))
    both = (by_the_fit(named, ("coulomb", "x", "stribeck")), named)
    strictly, contract = strict(both), or_alike(both)
    assert (strictly.absent, contract.absent) == (Rate(2, 2), Rate(1, 2))
    assert strictly.brier == pytest.approx(0.81)
    assert contract.brier == pytest.approx((0.1**2 + 0.9**2) / 2)
    assert [one.right for one in contract.reliability if one.right.of] == [Rate(1, 2)]
    assert (contract.claims, contract.untried) == (Rate(1, 1), 1)


def test_what_stands_for_a_nuisance_is_there_by_the_contract_but_no_right_answer() -> None:
    beside = case(STRIBECK, nuisances=(item("torque_offset", "y", torque=0.1),))
    alike = cause("coulomb_asymmetry", "y", p=0.8, indistinguishable_from=["torque_offset"])
    one = by_the_fit(judged(beside, report(alike)), ("coulomb_asymmetry", "y", "torque_offset"))
    assert (one.right, one.events, one.events_or_alike) == (False, ((0.8, False),), ((0.8, True),))


def test_a_nuisance_that_comes_first_is_there_but_not_the_answer() -> None:
    beside = case(STRIBECK, nuisances=(item("presliding", "z", displacement=1e-4), item("out_of_step", "y", delay=0.001)))
    found = scored(*(judged(beside, report(cause(*named))) for named in (("presliding", "z"), ("delay", "y"), ("delay", "x"))))
    assert (found.exact_first, found.there_first) == (Rate(0, 3), Rate(2, 3))


def test_parameters_of_the_model_that_are_off_may_come_before_the_right_answer_and_nothing_else_may() -> None:
    mass, cause_itself, other = cause("payload"), cause("stribeck"), cause("torque_ripple")
    answers = [report(mass, cause_itself), report(mass, other, cause_itself), report(mass)]
    assert scored(*(judged(case(STRIBECK), told, "off") for told in answers)).beside_the_model == Rate(1, 3)
    assert scored(*(judged(case(STRIBECK), told, "exact") for told in answers)).beside_the_model == Rate(0, 3)
    heavier = case(item("payload", mass=1.0))
    assert judged(heavier, report(mass, other), "off").first_beside_the_model_is_true


def test_a_cause_that_is_answered_by_the_name_of_a_nuisance_is_a_claim_and_another_nuisance_is_none() -> None:
    beside = case(STRIBECK, nuisances=(item("coulomb", share=0.03, coulomb=1.0), item("viscous", share=0.02, viscous=1.0)))
    told = report(cause("coulomb", indistinguishable_from=["stribeck", "viscous"]))
    assert claims(beside, told) == (Claim("coulomb", "x", "stribeck"),)


def test_a_position_that_is_early_is_no_delay() -> None:
    early = case(STRIBECK, nuisances=(item("out_of_step", "y", delay=-0.001),))
    assert ("delay", "y") not in early.there


def test_unknown_takes_the_largest_share_of_what_is_foreign() -> None:
    foreign = case(item("foreign:wind"), kind="foreign")
    assert judged(foreign, report(cause("stribeck"), unknown=0.5, stribeck=0.3, noise=0.2)).right
    assert judged(foreign, report(cause("unknown"), unknown=0.3, stribeck=0.2, noise=0.5)).right
    assert not judged(foreign, report(cause("unknown"), unknown=0.3, stribeck=0.5, noise=0.2)).right
    assert not judged(foreign, report(verdict="no_gap")).right


def test_clean_machine_is_right_without_a_gap_whatever_is_listed() -> None:
    clean = case(kind="clean")
    assert judged(clean, report(cause("stribeck", p=0.1), verdict="no_gap")).right
    assert judged(clean, report(cause("stribeck", p=0.1), verdict="no_gap")).first is None
    assert not judged(clean, report(cause("stribeck"))).right


def test_all_four_have_to_be_selected() -> None:
    four = case(*(item("viscous", axis, viscous=1.0) for axis in AXES), kind="four")
    chosen = tuple(("viscous", axis) for axis in AXES)
    found = scored(judged(four, report(selected=chosen)), judged(four, report(selected=chosen[:3])))
    assert found.all_four == Rate(1, 2)


def test_what_was_selected_and_is_not_there_is_a_share_of_all_selected() -> None:
    beside = case(STRIBECK, nuisances=(RIPPLE,))
    chosen = (("stribeck", "x"), ("torque_ripple", "y"), ("torque_ripple", "x"), ("inertia", "z"))
    assert scored(judged(beside, report(selected=chosen))).absent == Rate(2, 4)
    assert scored(judged(beside, report(selected=chosen), "off")).absent == Rate(1, 3)


def test_axes_made_worse_are_counted() -> None:
    gaps = {"x": Gap(1.0, 0.1, 0.0), "y": Gap(0.1, 0.2, 0.0), "z": Gap(0.1, 0.1, 0.0)}
    assert scored(judged(case(STRIBECK), report(), **gaps)).worse == Rate(1, 3)


def test_probabilities_are_held_to_strict_events() -> None:
    there, absent = (cause("stribeck", p=0.95), cause("torque_ripple", "y", p=0.35)), cause("delay", "z", p=0.31)
    causes = (*there, absent, cause("unknown", p=0.9))
    found = scored(judged(case(STRIBECK, nuisances=(RIPPLE,)), report(*causes)))
    assert {one.low: one.right for one in found.reliability if one.right.of} == {0.3: Rate(1, 2), 0.9: Rate(1, 1)}
    assert found.brier == pytest.approx((0.05**2 + 0.65**2 + 0.31**2) / 3)
    assert [(one.low, one.high) for one in found.reliability][-1] == (0.9, 1.0)


def test_unknown_is_an_event_where_there_is_something_foreign_or_nothing() -> None:
    unknown = report(cause("unknown", p=0.8), cause("unknown", "y", p=0.4))
    assert judged(case(item("foreign:wind"), kind="foreign"), unknown).events == ((0.8, True),)
    assert judged(case(kind="clean"), unknown).events == ((0.8, False), (0.4, False))


def test_intervals_are_held_to_the_true_parameters() -> None:
    inside = {"static_torque": estimate(1.2, 1.4), "stribeck_velocity": estimate(0.03, 0.04), "exponent": estimate(1.0, 2.0)}
    wave = {"amplitude": estimate(0.5, 0.6), "order": estimate(5.9, 6.1), "phase": estimate(-3.4, -3.2)}
    given = report(cause("stribeck", parameters=inside), cause("torque_ripple", "y", parameters=wave))
    other = item("torque_ripple", "y", amplitude=0.55, order=2.0, phase=0.0)
    found = judged(case(STRIBECK, nuisances=(other, RIPPLE)), given).covered
    assert found == (True, False, True, False, True, True)  # 3.0 - 2 pi is -3.28, and order 6 is meant


def test_told_shares_are_held_to_the_true_ones() -> None:
    assert scored(judged(case(STRIBECK), report(cause("stribeck", share=0.7)))).share_error == pytest.approx(0.1)
    assert scored(judged(case(STRIBECK), report(cause("delay")))).share_error is None


STUB = """
import json, sys
from pathlib import Path
sys.path.insert(0, {path!r})
import pyarrow as pa, pyarrow.parquet as pq
from drivetwin.blind.serving import serve

class Stub:
    def diagnose(self, model, training, validation, out):
        assert [str(one) for one in training] == ["train_1", "train_2"], training
        (out / "prediction").mkdir(parents=True)
        level = {{"gap_rms": 0.1, "noise_rms": 0.0, "significant": True, "shares": []}}
        cause = {{"effect": "stribeck", "axis": "x", "probability": 0.9, "share": 0.7}}
        (out / "report.json").write_text(json.dumps({{"schema": "gap-report/2", "verdict": "explained", "axes": {{"x": level}},
            "causes": [cause], "selected": [{{"effect": "stribeck", "axis": "x"}}]}}))
        columns = {{"torque_before": [0.0], "torque_after": [0.9], "torque_measured": [1.0], "used": [True]}}
        for recording in validation:
            table = pa.table({{f"x.{{name}}": values for name, values in columns.items()}})
            pq.write_table(table, out / "prediction" / f"{{recording.name}}.parquet")

serve(Stub(), sys.stdin, sys.stdout)
"""


def record(_case: Case, folder: Path) -> None:
    for name in ("train_1", "train_2", "validate_1"):
        (folder / name).mkdir(parents=True)
    for name in ("model.xml", "model_off.xml"):
        (folder / name).write_text("<mujoco/>", encoding="utf-8")


class Silent:
    """Nobody watches."""

    def sealed(self, commitment: str, answered: int) -> None: ...

    def of_other_code(self, failed: int) -> None: ...

    def examined(self) -> None: ...

    def claims(self, count: int) -> None: ...

    def tried(self) -> None: ...


def test_a_run_of_wide_cases_ends_in_a_score(tmp_path: Path) -> None:
    stub = tmp_path / "stub.py"
    stub.write_text(STUB.format(path=str(Path(__file__).parents[3])), encoding="utf-8")
    procedure = Procedure(
        "code", record=record, layout=Layout("train_*", "validate_*", None), diagnoser=(sys.executable, str(stub))
    )
    order = Order((case(STRIBECK),), 1, ("exact",))
    run(order, Place(tmp_path / "out"), procedure, cluster(None, 1), Silent())
    score = json.loads((tmp_path / "out/score.json").read_text(encoding="utf-8"))["nominal"]["exact"]
    assert (score["strict"]["exact_first"]["hits"], score["rates"]["effect_first"]["hits"]) == (1, 1)
    assert score["strict"]["worse"]["share"] == 0.0
    assert score["shrink"]["median"] == pytest.approx(1.0 - 0.1**2)
    assert score["strict"]["share_error"] == pytest.approx(0.1)
    key = json.loads((tmp_path / "out/key.json").read_text(encoding="utf-8"))
    assert key["cases"][0]["causes"][0]["share"] == 0.8
    assert "Strictly" in (tmp_path / "out/score.html").read_text(encoding="utf-8")


def test_a_claim_is_tried_once_and_the_score_says_what_came_of_it(tmp_path: Path) -> None:
    """The stand-in names the true effect only among what it cannot be told from, and writes no effects.json to try it with."""
    stub = tmp_path / "stub.py"
    text = STUB.format(path=str(Path(__file__).parents[3]))
    alike = text.replace('"share": 0.7}', '"share": 0.7, "indistinguishable_from": ["stribeck"]}').replace(
        '"effect": "stribeck"', '"effect": "coulomb"'
    )
    stub.write_text(alike, encoding="utf-8")
    procedure = Procedure(
        "code", record=record, layout=Layout("train_*", "validate_*", None), diagnoser=(sys.executable, str(stub))
    )
    order, place = Order((case(STRIBECK),), 1, ("exact",)), Place(tmp_path / "out")
    run(order, place, procedure, cluster(None, 1), Silent())
    written = place.outcome(0, "exact") / "alike.json"
    (claim,) = json.loads(written.read_text(encoding="utf-8"))["claims"]
    assert (claim["effect"], claim["axis"], claim["truth"], claim["holds"]) == ("coulomb", "x", "stribeck", False)
    score = json.loads((tmp_path / "out/score.json").read_text(encoding="utf-8"))["nominal"]["exact"]
    assert (score["rates"]["effect_first"]["hits"], score["or_alike"]["claims"]["of"]) == (0, 1)
    before = written.stat().st_mtime_ns
    run(order, place, procedure, cluster(None, 1), Silent())
    assert written.stat().st_mtime_ns == before


def test_measured_gaps_are_those_of_the_predictions(tmp_path: Path) -> None:
    """A report of gap-report/2 and its predictions, from disk."""
    given = report(cause("stribeck"))
    (tmp_path / "report.json").write_text(given.model_dump_json(by_alias=True), encoding="utf-8")
    (tmp_path / "prediction").mkdir()
    columns = {"torque_before": np.zeros(2), "torque_after": np.ones(2), "torque_measured": np.ones(2), "used": np.ones(2) > 0}
    pq.write_table(pa.table({f"x.{name}": v for name, v in columns.items()}), tmp_path / "prediction" / "validate_1.parquet")
    answer = read_answer(tmp_path)
    assert answer.report == given
    assert answer.gaps["x"].closed == 1.0
