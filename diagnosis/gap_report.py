"""gap-report/1 as values: the one place that says which keys report.json has, in which order, and what must hold among them."""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path
from typing import Annotated, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from diagnosis.result import NONE, UNKNOWN, Verdict
from drivetwin.errors import UserError

SCHEMA: Final = "gap-report/1"
_ROUNDING = 1e-6

Share = Annotated[FiniteFloat, Field(ge=0.0, le=1.0)]
Level = Annotated[FiniteFloat, Field(ge=0.0)]
Interval = tuple[FiniteFloat, FiniteFloat]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, from_attributes=True)


class FilterPart(_Part):
    """Zero-phase 4th-order Butterworth, and the speed [rad/s or m/s] above which an axis is in motion."""

    cutoff_hz: Annotated[FiniteFloat, Field(gt=0.0)]
    standstill_velocity: dict[str, Level]


class TestPart(_Part):
    """The test behind `significant`."""

    __test__ = False

    name: str
    p_value: Share


class RegimePart(_Part):
    """One entry of "where"."""

    regime: Literal["reversal", "presliding", "acceleration", "low_speed", "high_speed"]
    share: Share
    interval: dict[str, Interval]


class PatternPart(_Part):
    """One entry of "patterns"."""

    over: Literal["position", "load", "time", "frequency", "cross_axis"]
    share: Share
    detail: str


class AxisPart(_Part):
    """The gap of one axis; levels in N·m or N, rms over samples in motion."""

    torque_rms: Level
    gap_rms: Level
    noise_rms: Level
    standstill_rms: Level
    significant: bool
    test: TestPart
    where: list[RegimePart]
    patterns: list[PatternPart]

    @model_validator(mode="after")
    def _shares_add_up(self) -> Self:
        if self.where and abs(math.fsum(each.share for each in self.where) - 1.0) > _ROUNDING:
            raise ValueError("the shares of `where` do not add up to 1")
        return self


class EstimatePart(_Part):
    """A parameter with its unit and 90 % interval."""

    value: FiniteFloat
    unit: str
    ci90: Interval


class ShrinkPart(_Part):
    """1 - (gap_rms after / before)^2 on the validation data; `of_explainable` with the noise taken off, 0 if none is left."""

    validation: FiniteFloat
    ci90: Interval
    of_explainable: FiniteFloat


class CausePart(_Part):
    """One answer of one step; `unknown` has an axis and no parameters, `none` has neither."""

    step: Annotated[int, Field(ge=1)]
    effect: str
    axis: str | None
    probability: Share
    parameters: dict[str, EstimatePart]
    gap_closed: ShrinkPart | None
    indistinguishable_from: list[str]
    tell_apart_by: str

    @model_validator(mode="after")
    def _answers_beside_the_effects(self) -> Self:
        if self.effect in (UNKNOWN, NONE) and (self.parameters or self.gap_closed):
            raise ValueError(f"`{self.effect}` has no parameters and no gap_closed")
        if (self.axis is None) != (self.effect == NONE):
            raise ValueError(f"`{self.effect}` on axis {self.axis}: every answer but `none` has an axis")
        return self


class SelectedPart(_Part):
    """An effect that patched.xml adds."""

    effect: str
    axis: str


class AfterPart(_Part):
    """Gap of one axis with the selected effects [N·m or N]."""

    gap_rms: Level


class GapReport(_Part):
    """report.json, contract gap-report/1."""

    schema_: Literal["gap-report/1"] = Field(alias="schema")
    version: str
    inputs: dict[str, str]
    seed: int
    verdict: Verdict
    filter: FilterPart
    axes: dict[str, AxisPart]
    causes: list[CausePart]
    selected: list[SelectedPart]
    after: dict[str, AfterPart]

    @model_validator(mode="after")
    def _one_distribution_a_step(self) -> Self:
        steps: dict[int, list[float]] = defaultdict(list)
        for cause in self.causes:
            steps[cause.step].append(cause.probability)
        for step, probabilities in steps.items():
            if abs(math.fsum(probabilities) - 1.0) > _ROUNDING:
                raise ValueError(f"the probabilities of step {step} do not add up to 1")
            if probabilities != sorted(probabilities, reverse=True):
                raise ValueError(f"the causes of step {step} are not in order of probability")
        if list(steps) != sorted(steps):
            raise ValueError("the causes are not in order of their steps")
        return self

    @model_validator(mode="after")
    def _axes_are_known(self) -> Self:
        named = {cause.axis for cause in self.causes} - {None} | {each.axis for each in self.selected}
        if unknown := named - set(self.axes):
            raise ValueError(f"axis {', '.join(sorted(str(axis) for axis in unknown))} is not among the axes")
        if not set(self.after) == set(self.filter.standstill_velocity) == set(self.axes):
            raise ValueError("`after`, `filter` and `axes` are not about the same axes")
        return self


def read_report(path: Path) -> GapReport:
    """A report.json, checked. Raises UserError naming the file and what is missing or wrong."""
    try:
        return GapReport.model_validate_json(path.read_bytes(), strict=True)
    except FileNotFoundError:
        raise UserError(f"no file {path}; `drivetwin diagnose` writes report.json") from None
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        raise UserError(f"{path} is no {SCHEMA} file: {where}: {first['msg']}") from None
