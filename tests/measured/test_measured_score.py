"""The score of reports made by hand: right, wrong, named what must not be, refused, two effects, a control."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from measured.cases import Label, read_label
from measured.gap import Gap, read_gap
from measured.motion import Band
from measured.reference import Reference
from measured.run import Outcome, Status
from measured.score import CaseScore, score, score_case
from measured_bench import cause, report

from drivetwin.foundation.errors import UserError

ANSWERED = Outcome(Status.ANSWERED, "", 12.0, "code")

RIPPLE = read_label(
    {"effects": [{"effect": "torque_ripple", "axis": "motor"}], "also": ["position_friction"], "must_not": ["stribeck"]}
)
TWO = read_label(
    {
        "effects": [{"effect": "stribeck", "axis": "motor"}, {"effect": "torque_offset", "axis": "motor", "or": ["gravity"]}],
        "also": [],
        "must_not": [],
    }
)
CONTROL = read_label({"effects": [], "also": ["torque_ripple"], "must_not": ["coulomb", "stribeck"]})


def reference(before: float = 1.0, diagnosed: float = 0.5, after: float = 0.4) -> Reference:
    return Reference(
        Band(40.0, 0.1),
        "coulomb",
        "",
        torque=3.0,
        before=before,
        diagnosed=diagnosed,
        recorded=before,
        after=after,
        carried=after,
    )


@pytest.fixture
def gap_of(tmp_path: Path) -> Any:
    """Reads a report from disk, as the runner does."""

    def read(told: dict[str, Any]) -> Gap:
        file = tmp_path / "report.json"
        file.write_text(json.dumps(told), encoding="utf-8")
        return read_gap(file)

    return read


def scored(label: Label, gap: Gap | None, outcome: Outcome = ANSWERED, held_against: Reference | None = None) -> CaseScore:
    return score_case("case", "machine", label, outcome, gap, held_against or reference())


def test_the_lacking_effect_first_is_right(gap_of: Any) -> None:
    found = scored(RIPPLE, gap_of(report([cause("torque_ripple"), cause("unknown", 0.3)], selected=["torque_ripple"])))
    assert (found.strict, found.right, found.right_axis) == (True, True, True)
    assert found.both is None
    assert found.faults == ()


def test_an_accepted_effect_first_is_right_but_not_strictly(gap_of: Any) -> None:
    found = scored(RIPPLE, gap_of(report([cause("position_friction"), cause("torque_ripple")])))
    assert (found.strict, found.right) == (False, True)


@pytest.mark.parametrize("first", ["coulomb", "unknown"])
def test_anything_else_first_is_wrong_although_the_right_one_follows(gap_of: Any, first: str) -> None:
    found = scored(RIPPLE, gap_of(report([cause(first), cause("torque_ripple")])))
    assert (found.strict, found.right, found.right_axis) == (False, False, True)


def test_unknown_counts_where_it_is_accepted(gap_of: Any) -> None:
    label = read_label({"effects": [{"effect": "stribeck", "axis": "motor"}], "also": ["unknown"], "must_not": []})
    assert scored(label, gap_of(report([cause("unknown")]))).right


def test_the_right_effect_on_another_axis_is_wrong(gap_of: Any) -> None:
    found = scored(RIPPLE, gap_of(report([cause("torque_ripple", axis="elbow")])))
    assert (found.right, found.right_axis) == (False, False)


def test_no_cause_at_all_is_wrong_where_something_is_lacking(gap_of: Any) -> None:
    assert not scored(RIPPLE, gap_of(report([], verdict="no_gap"))).right


def test_what_must_not_be_named_is_a_fault_above_a_tenth(gap_of: Any) -> None:
    causes = [cause("torque_ripple"), cause("stribeck", 0.11), cause("stribeck", 0.10)]
    found = scored(RIPPLE, gap_of(report(causes)))
    assert found.right
    assert found.must_not == ("stribeck 0.11",)
    assert found.faults == ("names stribeck 0.11",)


@pytest.mark.parametrize("status", [Status.REFUSED, Status.CRASHED])
def test_no_answer_is_a_fault_with_its_line(status: Status) -> None:
    found = scored(RIPPLE, None, Outcome(status, "one direction only", 3.0, "code"))
    assert (found.strict, found.right, found.right_axis) == (False, False, False)
    assert (found.closed, found.ratio, found.reached) == (None, None, False)
    assert found.faults == (f"{status}: one direction only",)


def test_both_of_two_effects_are_to_be_selected(gap_of: Any) -> None:
    first = [cause("stribeck")]
    assert scored(TWO, gap_of(report(first, selected=["torque_offset", "stribeck"]))).both is True
    assert scored(TWO, gap_of(report(first, selected=["stribeck"]))).both is False
    assert scored(TWO, None, Outcome(Status.REFUSED, "", 0.0, "code")).both is False


def test_another_name_of_the_same_thing_is_accepted(gap_of: Any) -> None:
    found = scored(TWO, gap_of(report([cause("gravity")], selected=["gravity", "stribeck"])))
    assert (found.strict, found.right, found.both) == (False, True, True)


@pytest.mark.parametrize(
    ("causes", "selected", "verdict", "strict", "right"),
    [
        ([], [], "no_gap", True, True),
        (["torque_ripple"], ["torque_ripple"], "explained", False, True),
        (["torque_ripple"], ["torque_ripple", "inertia"], "explained", False, False),
        (["unknown"], [], "unexplained", False, False),
        (["coulomb"], ["coulomb"], "explained", False, False),
    ],
)
def test_a_control_is_right_with_nothing_but_what_is_accepted(
    gap_of: Any, causes: list[str], selected: list[str], verdict: str, strict: bool, right: bool
) -> None:
    found = scored(CONTROL, gap_of(report([cause(each) for each in causes], selected=selected, verdict=verdict)))
    assert (found.strict, found.right, found.right_axis) == (strict, right, right)
    assert found.ratio is None
    assert found.reached is None


def test_closed_is_held_against_what_the_reference_closes(gap_of: Any) -> None:
    found = scored(RIPPLE, gap_of(report([cause("torque_ripple")], before=1.0, after=0.5)))
    assert found.closed == pytest.approx(0.75)
    assert found.ratio == pytest.approx(0.75 / 0.84)
    assert found.reached is False
    enough = gap_of(report([cause("torque_ripple")], before=1.0, after=0.45))
    assert scored(RIPPLE, enough, held_against=reference(diagnosed=0.45)).reached is True


def test_the_ratio_is_of_the_gap_as_recorded_whatever_the_diagnosis_reads(gap_of: Any) -> None:
    """Half of a gap that is twice as large as it reads the torque is the gap as recorded: nothing is closed."""
    answer = gap_of(report([cause("torque_ripple")], before=2.0, after=1.0))
    read_late = replace(reference(before=2.0, diagnosed=1.0), recorded=1.0)
    found = scored(RIPPLE, answer, held_against=read_late)
    assert found.closed == pytest.approx(0.75)
    assert found.ratio == pytest.approx(0.0)
    assert found.reached is False


@pytest.mark.parametrize(("after", "reached"), [(0.9, True), (1.0, True), (1.1, False)])
def test_where_the_reference_closes_nothing_nothing_may_be_made_worse(gap_of: Any, after: float, *, reached: bool) -> None:
    answer = gap_of(report([cause("torque_ripple")], before=1.0, after=after))
    found = scored(RIPPLE, answer, held_against=reference(diagnosed=after, after=1.2))
    assert found.ratio is None
    assert found.reached is reached


def test_a_validation_made_worse_is_a_fault(gap_of: Any) -> None:
    found = scored(RIPPLE, gap_of(report([cause("torque_ripple")], after=1.1)), held_against=reference(diagnosed=1.1))
    assert found.faults == ("makes the validation of motor worse: 1 to 1.1",)
    assert found.closed == pytest.approx(1.0 - 1.1**2)


def test_figures_that_the_prediction_does_not_give_are_a_fault(gap_of: Any) -> None:
    found = scored(RIPPLE, gap_of(report([cause("torque_ripple")])), held_against=reference(before=0.9))
    assert found.faults == ("gap_rms is 1 in report.json and 0.9 in prediction/",)


def test_counts_are_over_all_cases_and_settings_must_be_alike(gap_of: Any) -> None:
    cases = [
        scored(RIPPLE, gap_of(report([cause("torque_ripple")], settings={"seed": 0, "block": 1.0}))),
        scored(RIPPLE, gap_of(report([cause("position_friction"), cause("stribeck", 0.5)]))),
        scored(TWO, gap_of(report([cause("stribeck")], selected=["stribeck", "torque_offset"]))),
        scored(CONTROL, gap_of(report([], verdict="no_gap"))),
        scored(RIPPLE, None, Outcome(Status.REFUSED, "no", 0.0, "code")),
        scored(RIPPLE, None, Outcome(Status.CRASHED, "ValueError", 0.0, "code")),
    ]
    found = score("code", cases)
    assert found.counts["right first answer"] == (4, 6)
    assert found.counts["strict"] == (3, 6)
    assert found.counts["both effects selected"] == (1, 1)
    assert found.counts["with a fault"] == (3, 6)
    assert found.summary == "right first answer 4 of 6 (strict 3); refused 1; crashed 1"
    assert found.crashed
    assert (found.settings, found.differing) == ({"seed": 0}, ("block",))
    assert json.loads(json.dumps(found.to_json()))["counts"]["refused"] == {"count": 1, "of": 6}


def test_a_report_of_another_contract_is_refused(gap_of: Any) -> None:
    with pytest.raises(UserError, match="gap-report/1; gap-report/2 is what is scored"):
        gap_of(report([]) | {"schema": "gap-report/1"})


def test_a_report_that_lacks_a_key_is_refused_by_its_name(gap_of: Any) -> None:
    told = report([])
    del told["settings"]
    with pytest.raises(UserError, match="lacks the key 'settings'"):
        gap_of(told)
