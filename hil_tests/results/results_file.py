"""results.json (accept/1): the one place that says which keys it has; what `--baseline` reads of an earlier release."""

from __future__ import annotations

import os
from collections.abc import Iterable
from math import isfinite
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat

from drivetwin.foundation.files import provenance, write_json
from drivetwin.foundation.typed_json import read_json
from drivetwin.hil_tests.bench import Bench, LimitValue
from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.verdict import CaseResult, Outcome

SCHEMA: Final = "accept/1"


def _finite(value: float | None) -> float | None:
    return value if value is not None and isfinite(value) else None


MaybeNumber = Annotated[FiniteFloat | None, BeforeValidator(_finite)]
"""JSON has no infinity: null is also what never came about, such as the settling time of an axis that does not settle."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, from_attributes=True)


class BenchPart(_Part):
    """What the bench file says, as far as figures depend on it; bit/s, s, limits in its own units."""

    controller: str
    machine: str
    profile: str
    truth: str | None
    model: str | None = None
    bus: str
    clock: str
    bit_rate: int
    bit_timing: bool
    cycle: FiniteFloat
    seed: int
    drives: str = "virtual"
    limits: dict[str, LimitValue]


class FailurePart(_Part):
    """A requirement that was not met; `time` is simulated [s], `measured` and `limit` in `unit`."""

    expectation: str
    message: str
    axis: str | None
    time: MaybeNumber
    measured: MaybeNumber
    limit: MaybeNumber
    unit: str


class MeasuredPart(_Part):
    """A quantity, the less the better, its unit, limit and noise (standard deviation from run to run; null: not known)."""

    name: str
    axis: str | None
    value: MaybeNumber
    unit: str
    limit: MaybeNumber
    noise: MaybeNumber


class CasePart(_Part):
    """A case; `folder` relative to results.json, null where it was skipped; `simulated` [s], of real drives by the wall clock;
    `not_judged` are expectations that only the plant's truth can answer; `tries` counts spoilt runs, too."""

    number: int
    group: str
    name: str
    title: str
    requirement: str
    outcome: Outcome
    skipped_because: str
    simulated: FiniteFloat
    folder: str | None
    failures: list[FailurePart]
    measured: list[MeasuredPart]
    not_judged: list[str] = []
    tries: int = 1


class Results(_Part):
    """results.json, contract accept/1."""

    schema_: Literal["accept/1"] = Field(alias="schema")
    version: str
    seed: int
    inputs: dict[str, str]
    accepted: bool
    digest: str
    bench: BenchPart
    cases: list[CasePart]


def write_results(acceptance: Acceptance, path: Path, inputs: Iterable[Path] = ()) -> None:
    """Write results.json, whole or not at all; `inputs` are the bench file and the scenarios, for their sha256.

    Two lockstep runs write the same bytes: it holds no wall-clock time.
    """
    results = Results(
        schema=SCHEMA,
        **provenance(acceptance.bench.seed, inputs, path.absolute().parent),
        accepted=acceptance.accepted,
        digest=acceptance.digest,
        bench=bench_part(acceptance.bench),
        cases=[_case(case, path.parent) for case in acceptance.cases],
    )
    write_json(path, results.model_dump(mode="json", by_alias=True))


def bench_part(bench: Bench) -> BenchPart:
    """What is kept of a bench."""
    otherwise = ("controller", "truth", "model", "machine")
    told = {name: getattr(bench, name) for name in BenchPart.model_fields if name not in otherwise}
    truth, model = (None if path is None else path.as_posix() for path in (bench.truth, bench.model))
    return BenchPart(**told, machine=bench.machine_name, controller=bench.controller.name, truth=truth, model=model)


def _case(case: CaseResult, beside: Path) -> CasePart:
    folder = None if case.folder is None else Path(os.path.relpath(case.folder, beside)).as_posix()
    told = {name: getattr(case, name) for name in CasePart.model_fields if name not in ("folder", "failures", "measured")}
    return CasePart(
        **told,
        folder=folder,
        failures=[FailurePart.model_validate(failure) for failure in case.failures],
        measured=[MeasuredPart.model_validate(measured) for measured in case.measured],
    )


def read_results(path: Path) -> Results:
    """A results.json, checked. Raises UserError naming the file and what is missing or wrong."""
    return read_json(Results, path, SCHEMA, "`drivetwin accept` writes results.json", strict=True)
