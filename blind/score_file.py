"""Writes score.json: every figure of the score, of the promised ones whether they were reached."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from drivetwin.blind.rates import Rate
from drivetwin.blind.score import Named, NominalScore, Score, Target
from drivetwin.blind.strict import Called, OrAlike, Strict
from drivetwin.foundation.files import write_json

SCHEMA = "blind-score/2"


def write_score(path: Path, score: Score) -> None:
    """Write score.json: nothing in it depends on when, where or on how many workers the run was made."""
    payload = {
        "schema": SCHEMA,
        "version": version("drivetwin"),
        "seed": score.seed,
        "cases": score.cases,
        "commitment": score.commitment,
        "code": score.code,
        "targets": [_target_json(target) for target in score.targets],
        "nominal": {of_nominal.nominal: _nominal_json(of_nominal) for of_nominal in score.nominal},
    }
    write_json(path, payload)


def _target_json(target: Target) -> dict[str, Any]:
    return {**vars(target), "reached": target.reached}


def _nominal_json(score: NominalScore) -> dict[str, Any]:
    named = ("effect_first", "effect_first_any_axis", "axis_first", "clean", "foreign", "both", "one_of_two_first")
    rates = (*named, "nothing_else", "promises")
    groups = ("by_effect", "by_machine", "by_formulation")
    return {
        "rates": {name: _rate_json(getattr(score, name)) for name in rates},
        "shrink": {"median": score.median_shrink, "shares": list(score.shrinks)},
        "calibration": _calibration_json(score.calibration),
        "brier": score.brier,
        "strict": _strict_json(score.strict),
        "or_alike": _or_alike_json(score.or_alike),
        **{name: _named_json(getattr(score, name)) for name in groups},
        "confusion": [vars(cell) for cell in score.confusion],
        "misses": [vars(miss) for miss in score.misses],
        "extras": [vars(extra) for extra in score.extras],
    }


def _strict_json(score: Strict) -> dict[str, Any]:
    rates = ("exact_first", "alike_first", "there_first", "all_four", "absent", "worse", "covered")
    return {
        **{name: _rate_json(getattr(score, name)) for name in rates},
        "reliability": _calibration_json(score.reliability),
        "brier": score.brier,
        "share_error": score.share_error,
    }


def _or_alike_json(score: OrAlike) -> dict[str, Any]:
    return {
        "absent": _rate_json(score.absent),
        "reliability": _calibration_json(score.reliability),
        "brier": score.brier,
        "claims": _rate_json(score.claims),
        "untried": score.untried,
    }


def _calibration_json(calibration: Iterable[Called]) -> list[dict[str, Any]]:
    return [{"called": [bin_.low, bin_.high], "mean": bin_.mean, **_rate_json(bin_.right)} for bin_ in calibration]


def _rate_json(found: Rate) -> dict[str, Any]:
    return {"hits": found.hits, "of": found.of, "share": found.value, "ci90": found.ci90}


def _named_json(named: Iterable[Named]) -> dict[str, Any]:
    return {one.name: _rate_json(one.rate) for one in named}
