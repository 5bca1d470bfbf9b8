"""Writes score.json: every figure of the score, of the promised ones whether they were reached."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

from drivetwin.blind.rates import Rate
from drivetwin.blind.score import NominalScore, Score
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
        "targets": [{**vars(target), "reached": target.reached} for target in score.targets],
        "nominal": {of_nominal.nominal: _nominal_json(of_nominal) for of_nominal in score.nominal},
    }
    write_json(path, payload)


def _nominal_json(score: NominalScore) -> dict[str, Any]:
    named = ("effect_first", "effect_first_any_axis", "axis_first", "clean", "foreign", "both", "one_of_two_first")
    rates = (*named, "nothing_else", "promises")
    groups = ("by_effect", "by_machine", "by_formulation")
    return {
        "rates": {name: _json(getattr(score, name)) for name in rates},
        "shrink": {"median": score.median_shrink, "shares": list(score.shrinks)},
        "calibration": _json(score.calibration),
        "brier": score.brier,
        "strict": _json(score.strict),
        "or_alike": _json(score.or_alike),
        **{name: {one.name: _json(one.rate) for one in getattr(score, name)} for name in groups},
        "confusion": [vars(cell) for cell in score.confusion],
        "misses": [vars(miss) for miss in score.misses],
        "extras": [vars(extra) for extra in score.extras],
    }


def _json(value: object) -> Any:
    """Rates and bins with what follows from them, anything made of them by the names of its fields."""
    match value:
        case Rate():
            return {**vars(value), "share": value.value, "ci90": value.ci90}
        case Called():
            return {"called": [value.low, value.high], "mean": value.mean, **_json(value.right)}
        case Strict() | OrAlike():
            return {name: _json(one) for name, one in vars(value).items()}
        case tuple():
            return [_json(one) for one in value]
    return value
