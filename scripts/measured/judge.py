"""From what a case left on disk to its score: the report, and the reference on the samples that the report counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drivetwin.errors import UserError
from measured.cases import Case
from measured.gap import Gap, read_gap
from measured.recipes import RECIPES
from measured.reference import Reference, reference
from measured.run import Outcome, Place, Status
from measured.score import CaseScore, Score, score, score_case


def judge(cases: Sequence[Case], place: Place, code: str) -> Score:
    """The score of everything that was answered by this code."""
    scores, settings = [], {}
    for case in cases:
        outcome, gap = _answer(case, place, code)
        scores.append(_score(case, place, outcome, gap))
        if gap is not None:
            settings[case.name] = gap.settings
    return score(code, scores, settings)


def judge_case(case: Case, place: Place, code: str) -> CaseScore:
    """The score of one case."""
    return _score(case, place, *_answer(case, place, code))


def _answer(case: Case, place: Place, code: str) -> tuple[Outcome, Gap | None]:
    """How the case ended; an exit status of 0 without a report by the contract is a crash as well."""
    outcome = place.outcome(case.name, code)
    if outcome.status is not Status.ANSWERED:
        return outcome, None
    try:
        return outcome, read_gap(place.diagnosis(case.name) / "report.json")
    except UserError as error:
        return replace(outcome, status=Status.CRASHED, line=str(error)), None


def _score(case: Case, place: Place, outcome: Outcome, gap: Gap | None) -> CaseScore:
    broken = ""
    try:
        held_against = _reference(case, place, gap)
    except UserError as error:
        broken, held_against = str(error), _reference(case, place, None)
    return score_case(case.name, case.machine, case.label, outcome, gap, held_against, broken)


def _reference(case: Case, place: Place, gap: Gap | None) -> Reference:
    """On the samples that the report counts; without one, in the band of the recipe and of the simulation as it stands."""
    recipe = RECIPES[case.name]
    if gap is None:
        return reference(recipe, case.model, case.training, case.validation, recipe.band, None)
    (axis,) = gap.axes.values()
    prediction = place.diagnosis(case.name) / "prediction"
    return reference(recipe, case.model, case.training, case.validation, axis.band, prediction)
