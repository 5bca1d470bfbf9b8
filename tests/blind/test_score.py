"""Each rule of the score on reports made by hand, and the rates against published values."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.stats import binomtest

from drivetwin.blind.answer import Answer, Gap, measure, read_answer
from drivetwin.blind.case import Case, Cause
from drivetwin.blind.claims import Claim, claims
from drivetwin.blind.judge import Judged
from drivetwin.blind.rates import Rate
from drivetwin.blind.score import Target, order_of_answers, score_nominal
from drivetwin.blind.told import Told

AXES = ("slide", "turn")
STRIBECK = Cause("stribeck", "slide", {})
PAYLOAD = Cause("payload", "turn", {})


def case(*causes: Cause, kind: str | None = None, number: int = 0) -> Case:
    of_number = ("clean", "single", "double")[len(causes)]
    return Case(number, 0, "arm", kind or of_number, causes, "lugre")  # type: ignore[arg-type]


def cause(effect: str, axis: str | None = "slide", p: float = 1.0, step: int = 1, **more: object) -> dict[str, object]:
    shrink = {"validation": 0.9, "ci90": (0.8, 0.95), "of_explainable": 0.92}
    named = effect not in ("unknown", "none")
    filled: dict[str, Any] = {"parameters": {}, "gap_closed": shrink if named else None}
    filled |= {"indistinguishable_from": [], "tell_apart_by": ""}
    return {"step": step, "effect": effect, "axis": axis, "probability": p, **filled, **more}


def report(*causes: dict[str, object], selected: tuple[tuple[str, str], ...] = (), verdict: str = "explained") -> Told:
    levels = {"torque_rms": 1.0, "gap_rms": 1.0, "noise_rms": 0.1, "standstill_rms": 0.0, "significant": True}
    return Told.model_validate(
        {
            "schema": "gap-report/1",
            "version": "0",
            "inputs": {},
            "seed": 0,
            "verdict": verdict,
            "filter": {"cutoff_hz": 48.0, "standstill_velocity": dict.fromkeys(AXES, 0.01)},
            "axes": {axis: {**levels, "test": {"name": "t", "p_value": 0.0}, "where": [], "patterns": []} for axis in AXES},
            "causes": list(causes),
            "selected": [{"effect": effect, "axis": axis} for effect, axis in selected],
            "after": {axis: {"gap_rms": 0.1} for axis in AXES},
        }
    )


def judged(truth: Case, told: Told | None, nominal: str = "exact", /, **gaps: Gap) -> Judged:
    return Judged(truth, Answer(told, gaps, {}, None if told else "died"), nominal)


def by_the_fit(one: Judged, *alike: tuple[str, str, str]) -> Judged:
    """The same, the fit having shown of these (effect, axis, true effect) that they are indistinguishable."""
    return replace(one, answer=replace(one.answer, alike=frozenset(alike), checked=max(len(alike), 1)))


COULOMB_FOR_STRIBECK = ("coulomb", "slide", "stribeck")


NO_GAP = report(cause("none", None, 0.99), cause("unknown", p=0.01), verdict="no_gap")


def test_single_effect_is_right_where_it_is_named_first_on_its_axis() -> None:
    assert judged(case(STRIBECK), report(cause("stribeck", p=0.6), cause("coulomb", p=0.4))).right
    assert not judged(case(STRIBECK), report(cause("coulomb", p=0.6), cause("stribeck", p=0.4))).right
    assert not judged(case(STRIBECK), report(cause("stribeck", "turn"))).right
    assert not judged(case(STRIBECK), NO_GAP).right
    assert not judged(case(STRIBECK), None).right


def test_indistinguishable_effect_counts_on_the_same_axis() -> None:
    alike: dict[str, Any] = {"indistinguishable_from": ["stribeck"]}
    named = judged(case(STRIBECK), report(cause("coulomb", **alike)))
    assert by_the_fit(named, COULOMB_FOR_STRIBECK).right
    assert by_the_fit(named, COULOMB_FOR_STRIBECK).effect_is_true
    assert not judged(case(STRIBECK), report(cause("coulomb", "turn", **alike))).right


def test_what_is_named_as_indistinguishable_and_is_not_by_the_fit_does_not_count() -> None:
    named = judged(case(STRIBECK), report(cause("coulomb", indistinguishable_from=["stribeck"])))
    assert claims(named.case, named.answer.report) == (Claim("coulomb", "slide", "stribeck"),)
    for one in (named, by_the_fit(named)):
        assert (one.right, one.effect_is_true, one.promise_is_right) == (False, False, False)


def test_what_is_there_or_selected_itself_is_no_claim() -> None:
    alike = cause("coulomb", indistinguishable_from=["stribeck"])
    itself = cause("stribeck", step=2, indistinguishable_from=["coulomb"])
    both = report(alike, itself, selected=(("coulomb", "slide"), ("stribeck", "slide")))
    assert claims(case(STRIBECK), both) == ()
    assert claims(case(STRIBECK), report(itself, alike)) == ()
    assert claims(case(PAYLOAD), report(alike)) == ()


def test_later_steps_do_not_answer_which() -> None:
    told = report(cause("coulomb"), cause("stribeck", step=2))
    assert told.first is not None
    assert told.first.effect == "coulomb"
    assert not judged(case(STRIBECK), told).right


def test_right_axis_is_that_of_the_first_cause() -> None:
    assert judged(case(STRIBECK), report(cause("coulomb"))).axis_is_true
    wrong = judged(case(STRIBECK), report(cause("stribeck", "turn")))
    assert (wrong.axis_is_true, wrong.effect_is_true) == (False, True)
    assert not judged(case(STRIBECK), NO_GAP).axis_is_true


def test_clean_machine_has_no_gap() -> None:
    assert judged(case(), NO_GAP).right
    assert not judged(case(), report(cause("coulomb"), selected=(("coulomb", "slide"),))).right
    assert not judged(case(), None).right


def test_clean_machine_with_nominal_off_may_be_told_so() -> None:
    off = report(cause("coulomb"), cause("inertia", "turn", step=2), selected=(("coulomb", "slide"), ("inertia", "turn")))
    assert judged(case(), off, "off").right
    assert judged(case(), NO_GAP, "off").right
    assert not judged(case(), report(cause("stribeck"), selected=(("stribeck", "slide"),)), "off").right
    assert not judged(case(), report(cause("coulomb"), cause("unknown", step=2), selected=(("coulomb", "slide"),)), "off").right
    assert not judged(case(), report(cause("coulomb"), selected=(("coulomb", "slide"), ("backlash", "slide"))), "off").right


def test_foreign_effect_is_unknown() -> None:
    foreign = case(Cause("foreign:fan", "slide", {}), kind="foreign")
    assert judged(foreign, report(cause("unknown", p=0.7), cause("stribeck", p=0.3), verdict="unexplained")).right
    assert not judged(foreign, report(cause("stribeck", p=0.7), cause("unknown", p=0.3))).right
    assert not judged(foreign, NO_GAP).right


def test_both_of_two_effects_are_selected() -> None:
    both = case(STRIBECK, PAYLOAD)
    causes = (cause("payload", "turn"), cause("stribeck", step=2))
    assert judged(both, report(*causes, selected=(("payload", "turn"), ("stribeck", "slide")))).right
    assert not judged(both, report(*causes, selected=(("payload", "turn"),))).right
    assert not judged(both, report(*causes, selected=(("payload", "slide"), ("stribeck", "slide")))).right
    assert not judged(both, None).right


def test_both_of_two_effects_count_as_indistinguishable_of_a_selected_one() -> None:
    both = case(STRIBECK, PAYLOAD)
    alike = cause("coulomb", step=2, indistinguishable_from=["stribeck"])
    told = (cause("payload", "turn"), alike)
    chosen = judged(both, report(*told, selected=(("payload", "turn"), ("coulomb", "slide"))))
    assert by_the_fit(chosen, COULOMB_FOR_STRIBECK).right
    assert not chosen.right
    assert not judged(both, report(*told, selected=(("payload", "turn"), ("viscous", "slide")))).right


def test_effects_that_are_selected_and_not_there() -> None:
    alike = cause("coulomb", step=2, indistinguishable_from=["stribeck"])
    selected = (("payload", "turn"), ("coulomb", "slide"), ("inertia", "turn"), ("delay", "slide"))
    told = report(cause("payload", "turn"), alike, selected=selected)
    both = by_the_fit(judged(case(STRIBECK, PAYLOAD), told), COULOMB_FOR_STRIBECK)
    assert both.others_selected == ("inertia@turn", "delay@slide")
    assert replace(both, nominal="off").others_selected == ("delay@slide",)
    assert judged(case(STRIBECK, PAYLOAD), told).others_selected == ("coulomb@slide", "inertia@turn", "delay@slide")
    one = by_the_fit(judged(case(STRIBECK), told), COULOMB_FOR_STRIBECK)
    assert one.others_selected == ("payload@turn", "inertia@turn", "delay@slide")
    assert judged(case(STRIBECK), None).others_selected == ()
    both_names = report(cause("stribeck"), alike, selected=(("stribeck", "slide"), ("coulomb", "slide")))
    assert judged(case(STRIBECK), both_names).others_selected == ("coulomb@slide",)


@pytest.mark.parametrize(
    ("truth", "told", "nominal", "right"),
    [
        (case(STRIBECK), report(cause("stribeck")), "exact", True),
        (case(STRIBECK), report(cause("stribeck", "turn")), "exact", False),
        (case(STRIBECK), report(cause("unknown")), "exact", False),
        (case(), NO_GAP, "exact", True),
        (case(), report(cause("coulomb")), "exact", False),
        (case(), report(cause("coulomb")), "off", True),
        (case(STRIBECK), NO_GAP, "exact", False),
        (case(Cause("foreign:fan", "slide", {}), kind="foreign"), report(cause("unknown")), "exact", True),
        (case(STRIBECK, PAYLOAD), report(cause("payload", "turn")), "exact", True),
    ],
)
def test_what_a_probability_speaks_of(truth: Case, told: Told, nominal: str, right: bool) -> None:
    assert judged(truth, told, nominal).promise_is_right is right


def test_gaps_are_recomputed_over_samples_in_use(tmp_path: Path) -> None:
    measured = np.array([1.0, 1.0, 1.0, 1.0])
    columns = {"torque_before": [0.0, 0.0, 0.0, 9.0], "torque_after": [0.5, 1.5, 0.5, -9.0], "torque_measured": measured}
    used = np.array([True, True, True, False])
    table = pa.table({"time": np.arange(4.0), "slide.used": used, **{f"slide.{name}": v for name, v in columns.items()}})
    pq.write_table(table, tmp_path / "a.parquet")
    pq.write_table(table, tmp_path / "b.parquet")
    gap = measure(sorted(tmp_path.iterdir()), {"slide": 0.3})["slide"]
    assert (gap.before, gap.after, gap.noise) == pytest.approx((1.0, 0.5, 0.3))
    assert gap.closed == pytest.approx(0.75)
    assert gap.of_explainable == pytest.approx(1.0 - (0.25 - 0.09) / (1.0 - 0.09))


def test_less_than_noise_is_no_more_than_all() -> None:
    assert Gap(1.0, 0.05, 0.1).of_explainable == 1.0
    assert Gap(0.1, 0.05, 0.1).of_explainable is None


def test_shrink_is_of_the_axes_that_have_an_effect() -> None:
    gaps = {"slide": Gap(1.0, 0.1, 0.1), "turn": Gap(1.0, 1.0, 0.1)}
    assert judged(case(STRIBECK), report(cause("stribeck")), **gaps).shrinks == pytest.approx((1.0,))
    assert judged(case(STRIBECK, PAYLOAD), report(cause("stribeck")), **gaps).shrinks == pytest.approx((1.0, 0.0))
    assert judged(case(STRIBECK), None).shrinks == (0.0,)
    assert judged(case(STRIBECK), report(cause("stribeck")), slide=Gap(0.1, 0.1, 0.2)).shrinks == ()


def test_promise_is_held_against_fresh_motion() -> None:
    told = report(cause("stribeck"))
    truth = case(STRIBECK)
    inside, outside = Gap(1.0, np.sqrt(0.1), 0.0), Gap(1.0, np.sqrt(0.3), 0.0)
    validation = {"slide": Gap(1.0, 0.1, 0.0)}
    answers = [Answer(told, validation, {"slide": gap}, None) for gap in (inside, outside, inside)]
    nothing = Answer(NO_GAP, {}, {"slide": inside}, None)
    assert score_nominal("exact", [truth] * 3 + [case()], [*answers, nothing]).promises == Rate(2, 3)


def test_calibration_and_brier() -> None:
    called = (0.55, 0.75, 0.95, 1.0, 0.92)
    right = (True, False, True, True, False)
    told = [
        report(cause("stribeck" if good else "spring", p=p), cause("unknown", p=1.0 - p))
        for p, good in zip(called, right, strict=True)
    ]
    scored = score_nominal("exact", [case(STRIBECK)] * 5, [Answer(one, {}, {}, None) for one in told])
    assert [(one.low, one.right) for one in scored.calibration] == [
        (0.0, Rate(0, 0)),
        (0.5, Rate(1, 1)),
        (0.7, Rate(0, 1)),
        (0.9, Rate(2, 3)),
    ]
    assert scored.calibration[-1].mean == pytest.approx((0.95 + 1.0 + 0.92) / 3)
    assert scored.brier == pytest.approx((0.45**2 + 0.75**2 + 0.05**2 + 0.0 + 0.92**2) / 5)


def test_rates_tables_and_misses_of_a_mixed_run() -> None:
    foreign = case(Cause("foreign:fan", "slide", {}), kind="foreign", number=3)
    cases = [case(number=0), case(STRIBECK, number=1), case(PAYLOAD, number=2), foreign, case(STRIBECK, PAYLOAD, number=4)]
    told = [NO_GAP, report(cause("stribeck")), report(cause("stribeck")), report(cause("unknown")), None]
    scored = score_nominal("exact", cases, [Answer(one, {}, {}, None if one else "died") for one in told])
    rates = (scored.clean, scored.effect_first, scored.axis_first, scored.foreign, scored.both)
    assert rates == (Rate(1, 1), Rate(1, 2), Rate(1, 2), Rate(1, 1), Rate(0, 1))
    assert {one.name: one.rate for one in scored.by_effect} == {
        "foreign:fan": Rate(1, 1),
        "none": Rate(1, 1),
        "payload": Rate(0, 1),
        "stribeck": Rate(1, 1),
    }
    assert {(cell.truth, cell.answer): cell.count for cell in scored.confusion} == {
        ("foreign:fan", "unknown"): 1,
        ("none", "none"): 1,
        ("payload", "stribeck"): 1,
        ("stribeck", "stribeck"): 1,
    }
    truths, answers = order_of_answers(scored.confusion)
    assert truths == ["payload", "stribeck", "foreign:fan", "none"]
    assert answers == ["stribeck", "none", "unknown"]
    missed = [(miss.number, miss.answer, miss.failed) for miss in scored.misses]
    assert missed == [(2, "stribeck", None), (4, "no answer", "died")]
    assert (scored.nothing_else, scored.extras) == (Rate(2, 2), ())


def test_what_was_selected_beside_the_truth_is_counted_and_told() -> None:
    cases = [case(STRIBECK, number=1), case(STRIBECK, PAYLOAD, number=2)]
    beside = report(cause("stribeck"), selected=(("stribeck", "slide"), ("delay", "turn")))
    alone = report(cause("stribeck"), selected=(("stribeck", "slide"),))
    scored = score_nominal("exact", cases, [Answer(one, {}, {}, None) for one in (beside, alone)])
    assert scored.nothing_else == Rate(1, 2)
    assert [(extra.number, extra.truth, extra.others) for extra in scored.extras] == [(1, "stribeck", ("delay@turn",))]


def test_nominal_off_may_cost_five_points() -> None:
    exact, off = (score_nominal(nominal, [], []).targets for nominal in ("exact", "off"))
    wanted = {target.name: target.wanted for target in exact}
    assert wanted == {
        "effect_first": 0.95,
        "axis_first": 0.99,
        "clean": 0.98,
        "foreign": 0.90,
        "both": 0.85,
        "shrink": 0.95,
        "promises": 0.90,
    }
    less = {target.name: round(wanted[target.name] - target.wanted, 3) for target in off}
    assert less == {**dict.fromkeys(wanted, 0.05), "shrink": 0.0, "promises": 0.0}


def test_target_without_cases_is_neither_reached_nor_missed() -> None:
    none = Target("clean", "", "exact", None, None, 0, 0.98)
    assert none.reached is None
    assert replace(none, value=0.98, of=50).reached is True
    assert replace(none, value=0.979, of=50).reached is False


@pytest.mark.parametrize(("hits", "of"), [(0, 10), (10, 10), (1, 3), (143, 150), (48, 50)])
def test_interval_is_wilsons(hits: int, of: int) -> None:
    expected = binomtest(hits, of).proportion_ci(0.90, method="wilson")
    assert Rate(hits, of).ci90 == pytest.approx((expected.low, expected.high))


@pytest.mark.parametrize("content", ["{", '{"schema": "gap-report/2"}', '{"schema": "gap-report/3"}'])
def test_report_that_breaks_the_contract_is_no_answer(tmp_path: Path, content: str) -> None:
    (tmp_path / "report.json").write_text(content, encoding="utf-8")
    answer = read_answer(tmp_path)
    assert answer.report is None
    assert answer.failed is not None
    assert "contract" in answer.failed


def test_prediction_that_is_no_number_is_no_answer(tmp_path: Path) -> None:
    told = report(cause("stribeck"))
    (tmp_path / "report.json").write_text(told.model_dump_json(by_alias=True), encoding="utf-8")
    (tmp_path / "prediction").mkdir()
    columns = {"torque_before": [0.0], "torque_after": [np.nan], "torque_measured": [1.0], "used": [True]}
    pq.write_table(pa.table({f"slide.{name}": v for name, v in columns.items()}), tmp_path / "prediction" / "a.parquet")
    answer = read_answer(tmp_path)
    assert answer.failed is not None
    assert "not finite" in answer.failed
