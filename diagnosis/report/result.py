"""What a diagnosis finds, as values: the gap of each axis, how its energy is divided up, its causes, and what is predicted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, FiniteFloat

from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.identification.frequency.resonances import Resonances
from drivetwin.recording.recording import Recording
from drivetwin.twin.comparison import Comparison

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TWO_SIDED_90 = 1.645
"""Standard deviations to either side of a normal 90 % interval."""
UNKNOWN, NOISE = "unknown", "noise"
"""Parts of a gap beside the effects: what no effect of the library explains, and what is no gap."""

# Bounds that report.json keeps: schema.py checks them when the file is written and when it is read.
Proportion = Annotated[FiniteFloat, Field(ge=0.0, le=1.0)]
Level = Annotated[FiniteFloat, Field(ge=0.0)]
Interval = tuple[FiniteFloat, FiniteFloat]
RegimeName = Literal["reversal", "presliding", "acceleration", "low_speed", "high_speed"]


class Verdict(StrEnum):
    """Of the whole diagnosis; contract gap-report/2, 'Definitions'."""

    NO_GAP = "no_gap"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter with its unit and its two-sided 90 % interval."""

    value: FiniteFloat
    unit: str
    ci90: Interval


@dataclass(frozen=True)
class Share:
    """Part of the energy of an axis's gap on motion that was not fitted, with its 90 % interval; `of` an effect or else."""

    of: str
    share: Proportion
    ci90: Interval


@dataclass(frozen=True)
class Regime:
    """Share of an axis's gap energy above noise in one regime of the motion, and the regime's bounds by quantity."""

    regime: RegimeName
    share: Proportion
    interval: Mapping[str, Interval]


@dataclass(frozen=True)
class Pattern:
    """How the gap of an axis varies over a quantity: share of its energy that goes with it, and a word to it."""

    over: Literal["position", "load", "time", "frequency", "cross_axis"]
    share: Proportion
    detail: str


@dataclass(frozen=True)
class Unknown:
    """What no effect of the library explains: its share of the gap, what it goes with, and how long it lasts [s]."""

    share: Proportion
    goes_with: tuple[str, ...]
    correlation_time: Level


@dataclass(frozen=True)
class AxisGap:
    """Gap of one axis on the validation data [N·m or N, rms over moving samples].

    `noise_rms` is noise alone, `noise_found_by` says how it was measured; `model_error_rms` is what a model of this kind is
    expected to miss. `shares` add up to 1.
    """

    cutoff_hz: float
    standstill_velocity: float
    torque_rms: float
    gap_rms: float
    noise_rms: float
    noise_found_by: str
    model_error_rms: float
    standstill_rms: float
    significant: bool
    test: str
    p_value: float
    shares: tuple[Share, ...]
    where: tuple[Regime, ...]
    where_after: tuple[Regime, ...]
    patterns: tuple[Pattern, ...]
    unknown: Unknown
    not_testable: tuple[NotTestable, ...]


@dataclass(frozen=True)
class Shrink:
    """gap_closed on the validation data, its 90 % interval, and the same with the noise taken off.

    `of_explainable` is None where the gap is no larger than the noise: there is nothing to explain.
    """

    validation: float
    ci90: tuple[float, float]
    of_explainable: float | None


@dataclass(frozen=True)
class Cause:
    """One effect on one axis, or `unknown`, which has no parameters and no shrink.

    `probability`: that it, or one of those that it is indistinguishable from, is there. `share`: of the gaps
    of all axes together, each axis's energy over that of its torque.
    """

    effect: str
    axis: str
    probability: float
    share: float
    parameters: Mapping[str, Estimate]
    gap_closed: Shrink | None
    indistinguishable_from: tuple[str, ...] = ()
    tell_apart_by: str = ""
    or_by_sensor: str = ""


@dataclass(frozen=True)
class CorrectedMass:
    """A body of another mass than the model has, its inertia in proportion: a nominal parameter, which is no effect.

    `mass` and `nominal` [kg]. `share`: of the gaps of all axes together, as of a `Cause`. `gap_closed`: on `axis`, of whose gap
    it takes most. `instead`: effects that it may be, most probable first.
    """

    body: str
    axis: str
    mass: Estimate
    nominal: float
    share: float
    gap_closed: Shrink | None
    instead: tuple[str, ...] = ()


@dataclass(frozen=True)
class Residual:
    """A table of what has no name on an axis, which the patch has beside the selected effects.

    `of_unknown`: share of the unknown's energy that it closes on motion that was not fitted; `gap_rms`: of what is left there
    with it [N·m or N].
    """

    table: PlacedEffect
    of_unknown: float
    gap_rms: float


@dataclass(frozen=True)
class AxisPrediction:
    """One axis over a recording, all (n,): filtered torques [N·m or N] and motion, and the samples that count.

    `before`, `after`: what the simulation predicts for the measured motion without and with the selected effects.
    """

    before: Array
    after: Array
    measured: Array
    used: Mask
    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True)
class Prediction:
    """What is predicted for one recording, on its own time (n,) [s]."""

    recording: str
    time: Array
    axes: Mapping[str, AxisPrediction]

    @property
    def period(self) -> float:
        """Between two samples [s]."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class FrequencyResponse:
    """Velocity over torque of one axis (m,), as far as both follow what drove it: `instrument`, a column of the recordings.

    `frequency` [Hz], `mechanics` [rad/s per N·m or m/s per N], `coherence` of the worse of both with the instrument 0..1,
    `sure` the lines that are reliable. `windows` were averaged, `seconds` long each.
    """

    instrument: str
    frequency: Array
    mechanics: NDArray[np.complex128]
    coherence: Array
    sure: Mask
    windows: int
    seconds: float
    resonances: Resonances


@dataclass(frozen=True)
class NoResponse:
    """Why the recordings tell no frequency response of an axis."""

    reason: str


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer.

    `held_back`: the validation data are blocks held back from the training recordings. `selected` is what the patch adds, in
    order of adding; `units` of their parameters are filled. `masses`: bodies whose mass the patched model corrects, largest
    share first. `model_xml`: the patched model's MJCF. `notes`: sentences that the reader needs. `validation`: the recordings,
    or blocks of them, that the figures are of; `closed_loop`: those of them that were moved in closed loop. `responses` by
    axis: of all recordings, fitted or not. `residual`: tables that effects.json has as well, where they were asked for, and
    `with_residual` what is predicted with them; nothing else knows of them.
    """

    verdict: Verdict
    settings: Settings
    axes: Mapping[str, AxisGap]
    causes: tuple[Cause, ...]
    selected: tuple[PlacedEffect, ...]
    after_rms: Mapping[str, float]
    predictions: tuple[Prediction, ...]
    model_xml: str
    held_back: bool
    units: Mapping[str, str]
    masses: tuple[CorrectedMass, ...] = ()
    notes: tuple[str, ...] = ()
    validation: tuple[Recording, ...] = ()
    closed_loop: tuple[Comparison, ...] = ()
    responses: Mapping[str, FrequencyResponse | NoResponse] = field(default_factory=dict)
    residual: tuple[Residual, ...] = ()
    with_residual: tuple[Prediction, ...] = ()

    @property
    def patch(self) -> tuple[PlacedEffect, ...]:
        """What effects.json holds: the selected effects, and the tables of what has no name."""
        return (*self.selected, *(each.table for each in self.residual))
