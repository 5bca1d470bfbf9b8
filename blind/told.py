"""What a gap report tells, as far as it is scored: read from gap-report/2, or from gap-report/1 in the same words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from drivetwin.foundation.typed_json import read_json

UNKNOWN, NONE, NOISE, NO_GAP = "unknown", "none", "noise", "no_gap"
"""Answers beside the effects, what else a gap is shared out to, and the verdict of a machine without a gap."""

Share = Annotated[FiniteFloat, Field(ge=0.0, le=1.0)]
Interval = tuple[FiniteFloat, FiniteFloat]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", populate_by_name=True)


class ToldShare(_Part):
    """What part of an axis's gap goes to an effect, to `unknown` or to `noise`."""

    of: str
    share: FiniteFloat


class ToldAxis(_Part):
    """One axis [N·m or N]; `shares` is empty in gap-report/1."""

    gap_rms: FiniteFloat
    noise_rms: FiniteFloat
    significant: bool
    shares: list[ToldShare] = []

    @property
    def largest(self) -> str | None:
        """What takes most of the gap, noise aside; None where nothing is said."""
        named = [one for one in self.shares if one.of != NOISE]
        return max(named, key=lambda one: one.share).of if named else None


class ToldEstimate(_Part):
    """A parameter and its 90 % interval."""

    value: FiniteFloat
    ci90: Interval


class ToldShrink(_Part):
    """How much of the gap's energy a cause closes on validation motion."""

    ci90: Interval


class ToldCause(_Part):
    """One cause; `step` is of gap-report/1 only, `share` of gap-report/2."""

    effect: str
    axis: str | None
    probability: Share
    share: FiniteFloat | None = None
    step: int = 1
    parameters: dict[str, ToldEstimate] = {}
    gap_closed: ToldShrink | None = None
    indistinguishable_from: list[str] = []


class ToldSelected(_Part):
    """An effect that the patch adds."""

    effect: str
    axis: str


class Told(_Part):
    """A gap report; `causes` in the order in which they are answers to "which"."""

    schema_: Literal["gap-report/1", "gap-report/2"] = Field(alias="schema")
    verdict: Literal["no_gap", "explained", "partly_explained", "unexplained"]
    axes: dict[str, ToldAxis]
    causes: list[ToldCause]
    selected: list[ToldSelected]

    @property
    def first(self) -> ToldCause | None:
        """The answer to "which"; None where there is none, or where gap-report/2 finds no gap."""
        if self.schema_ == "gap-report/2" and self.verdict == NO_GAP:
            return None
        return self.causes[0] if self.causes else None

    @property
    def leading(self) -> tuple[ToldCause, ...]:
        """The most probable cause of each step."""
        steps: dict[int, ToldCause] = {}
        for cause in self.causes:
            steps.setdefault(cause.step, cause)
        return tuple(steps.values()) if self.first else ()


def told(payload: Any) -> Told:
    """A report from what its JSON holds; raises ValidationError where it breaks the contract."""
    return Told.model_validate(payload)


def read_told(path: Path) -> Told:
    """A report.json; raises UserError naming file, key and what is wrong."""
    return read_json(Told, path, "gap report", "`drivetwin diagnose` writes report.json")
