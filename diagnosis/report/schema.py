"""gap-report/2 as values: the one place that says which keys report.json has, in which order, and what must hold among them."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.report.result import (
    UNKNOWN,
    Estimate,
    Interval,
    Level,
    Pattern,
    Proportion,
    Regime,
    Share,
    Unknown,
    Verdict,
)
from drivetwin.foundation.typed_json import read_json

SCHEMA: Final = "gap-report/2"
_ROUNDING = 1e-6


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, from_attributes=True, revalidate_instances="always")


class TestPart(_Part):
    """The test behind `significant`."""

    __test__ = False

    name: str
    p_value: Proportion


class AxisPart(_Part):
    """The gap of one axis; levels in N·m or N, rms over samples in motion."""

    cutoff_hz: Annotated[FiniteFloat, Field(gt=0.0)]
    standstill_velocity: Level | None
    torque_rms: Level
    gap_rms: Level
    noise_rms: Level
    model_error_rms: Level
    standstill_rms: Level
    significant: bool
    test: TestPart
    shares: tuple[Share, ...]
    where: tuple[Regime, ...]
    where_after: tuple[Regime, ...]
    patterns: tuple[Pattern, ...]
    unknown: Unknown
    not_testable: tuple[NotTestable, ...]

    @model_validator(mode="after")
    def _shares_add_up(self) -> Self:
        for name, parts in (("where", self.where), ("where_after", self.where_after), ("shares", self.shares)):
            if parts and abs(math.fsum(each.share for each in parts) - 1.0) > _ROUNDING:
                raise ValueError(f"the shares of `{name}` do not add up to 1")
        return self


class ShrinkPart(_Part):
    """1 - (gap_rms after / before)^2 on the validation data; `of_explainable` with the noise taken off, 0 if none is left."""

    validation: FiniteFloat
    ci90: Interval
    of_explainable: FiniteFloat


class CausePart(_Part):
    """An effect on an axis; `unknown` has no parameters."""

    effect: str
    axis: str
    probability: Proportion
    share: Proportion
    parameters: dict[str, Estimate]
    gap_closed: ShrinkPart | None
    indistinguishable_from: list[str]
    tell_apart_by: str
    or_by_sensor: str

    @model_validator(mode="after")
    def _unknown_is_no_effect(self) -> Self:
        if self.effect == UNKNOWN and (self.parameters or self.gap_closed):
            raise ValueError(f"`{self.effect}` has no parameters and no gap_closed")
        return self


class SelectedPart(_Part):
    """An effect that patched.xml adds."""

    effect: str
    axis: str


class MassPart(_Part):
    """A body whose mass patched.xml corrects, `nominal` [kg] in the model; no effect."""

    body: str
    axis: str
    mass: Estimate
    nominal: Level
    share: Proportion
    gap_closed: ShrinkPart | None
    instead: list[str] = Field(default=[], exclude_if=lambda told: not told)


class AfterPart(_Part):
    """Gap of one axis with the selected effects [N·m or N]."""

    gap_rms: Level


class ResidualPart(_Part):
    """A table of what has no name on an axis, which effects.json has: how much of the unknown it closes, and what is left."""

    axis: str
    of_unknown: FiniteFloat
    gap_rms: Level


class ApartPart(_Part):
    """How far a simulated signal is from the measured one: rms, and 2-norm over that of the measured."""

    rms_error: Level
    relative_error: Level


class SignalPart(_Part):
    """A signal in closed loop, as the model moves without and with the effects."""

    unit: str
    measured_rms: Level
    measured_range: Level
    model: ApartPart
    with_effects: ApartPart


class ClosedLoopPart(_Part):
    """One axis of a validation recording, replayed; `signals` by name."""

    loops: str
    signals: dict[str, SignalPart]


class GapReport(_Part):
    """report.json, contract gap-report/2."""

    schema_: Literal["gap-report/2"] = Field(alias="schema")
    version: str
    inputs: dict[str, str]
    seed: int
    settings: dict[str, float | int | None]
    verdict: Verdict
    axes: dict[str, AxisPart]
    causes: list[CausePart]
    selected: list[SelectedPart]
    after: dict[str, AfterPart]
    closed_loop: dict[str, dict[str, ClosedLoopPart]] = Field(default={}, exclude_if=lambda told: not told)
    """By recording and axis; no key where none was replayed."""
    masses: list[MassPart] = Field(default=[], exclude_if=lambda told: not told)
    """No key where patched.xml corrects none."""
    residual: list[ResidualPart] = Field(default=[], exclude_if=lambda told: not told)
    """Of --with-residual; no key without a table."""

    @model_validator(mode="after")
    def _most_first(self) -> Self:
        weights = [cause.probability * cause.share for cause in self.causes]
        if any(later > earlier + _ROUNDING for earlier, later in pairwise(weights)):
            raise ValueError("the causes are not in the order of probability times share")
        return self

    @model_validator(mode="after")
    def _significant_axes_have_a_cause(self) -> Self:
        named = {cause.axis for cause in self.causes if cause.probability > 0.2}
        missing = [name for name, axis in self.axes.items() if axis.significant and name not in named]
        if missing:
            raise ValueError(f"axis {', '.join(missing)} has a gap and no cause")
        return self

    @model_validator(mode="after")
    def _axes_are_known(self) -> Self:
        named = {cause.axis for cause in self.causes} | {each.axis for each in self.selected}
        if unknown := named - set(self.axes):
            raise ValueError(f"axis {', '.join(sorted(str(axis) for axis in unknown))} is not among the axes")
        if set(self.after) != set(self.axes):
            raise ValueError("`after` and `axes` are not about the same axes")
        return self


def read_report(path: Path) -> GapReport:
    """A report.json, checked. Raises UserError naming the file and what is missing or wrong."""
    return read_json(GapReport, path, SCHEMA, "`drivetwin diagnose` writes report.json", strict=True)
