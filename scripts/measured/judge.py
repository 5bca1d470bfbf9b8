"""From what a case left on disk to its score: the report, and the reference on the samples that the report counts."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.foundation.errors import UserError
from measured.cases import Case
from measured.gap import Gap, read_gap
from measured.recipes import RECIPES
from measured.reference import Reference, reference
from measured.run import Outcome, Place, Status
from measured.score import CaseScore, score_case


def judge_case(case: Case, place: Place, code: str) -> CaseScore:
    """The score of a case as this code answered it."""
    outcome, gap = _answer(case, place, code)
    broken = ""
    try:
        held_against = _reference(case, place, gap)
    except UserError as error:
        broken, held_against = str(error), _reference(case, place, None)
    return score_case(case.name, case.machine, case.label, outcome, gap, held_against, broken)


def _answer(case: Case, place: Place, code: str) -> tuple[Outcome, Gap | None]:
    """How the case ended; an exit status of 0 without a report by the contract is a crash as well."""
    outcome = place.outcome(case.name, code)
    if outcome.status is not Status.ANSWERED:
        return outcome, None
    try:
        return outcome, read_gap(place.diagnosis(case.name) / "report.json")
    except UserError as error:
        return replace(outcome, status=Status.CRASHED, line=str(error)), None


def _reference(case: Case, place: Place, gap: Gap | None) -> Reference:
    """On the samples that the report counts; without one, in the band of the recipe and of the simulation as it stands."""
    recipe = RECIPES[case.name]
    if gap is None:
        return reference(recipe, case.model, case.training, case.validation, recipe.band, None)
    (axis,) = gap.axes.values()
    prediction = place.diagnosis(case.name) / "prediction"
    return reference(recipe, case.model, case.training, case.validation, axis.band, prediction)
