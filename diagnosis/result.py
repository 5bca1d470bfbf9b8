"""What a diagnosis finds, as values: the gap of each axis, its causes step by step, and what is predicted with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from emulator.effects import PlacedEffect

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TWO_SIDED_90 = 1.645
"""Standard deviations to either side of a normal 90 % interval."""
UNKNOWN, NONE = "unknown", "none"
"""Answers beside the effects: a gap that no effect explains, and no gap (more)."""


class Verdict(StrEnum):
    """Of the whole diagnosis; contract gap-report/1, 'Definitions'."""

    NO_GAP = "no_gap"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter with its unit and its two-sided 90 % interval."""

    value: float
    unit: str
    ci90: tuple[float, float]


@dataclass(frozen=True)
class Regime:
    """Share of an axis's gap energy above noise in one regime of the motion, and the regime's bounds by quantity."""

    regime: str
    share: float
    interval: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Pattern:
    """How the gap of an axis varies over a quantity: share of its energy that goes with it, and a word to it."""

    over: str
    share: float
    detail: str


@dataclass(frozen=True)
class AxisGap:
    """Gap of one axis on the validation data [N·m or N, rms over moving samples]; `noise_found_by`: how its noise was found.

    `significant` also where only the fitted motion shows a gap: `where` and `patterns` are of that then.
    """

    torque_rms: float
    gap_rms: float
    noise_rms: float
    noise_found_by: str
    standstill_rms: float
    significant: bool
    test: str
    p_value: float
    where: tuple[Regime, ...]
    patterns: tuple[Pattern, ...]


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
    """One answer of one step; `unknown` and `none` have no parameters and no shrink, `none` has no axis."""

    step: int
    effect: str
    axis: str | None
    probability: float
    parameters: Mapping[str, Estimate]
    gap_closed: Shrink | None
    indistinguishable_from: tuple[str, ...] = ()
    tell_apart_by: str = ""


@dataclass(frozen=True)
class AxisPrediction:
    """One axis over a validation recording, all (n,): filtered torques [N·m or N] and motion, and the samples that count.

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
    """What is predicted for one validation recording, on its own time (n,) [s]."""

    recording: str
    time: Array
    axes: Mapping[str, AxisPrediction]

    @property
    def period(self) -> float:
        """Between two samples [s]."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class FittedGap:
    """Gap of an axis that only the fitted motion shows [N·m or N, rms over moving samples], before and after the patch."""

    torque_rms: float
    gap_rms: float
    after_rms: float
    predictions: tuple[Prediction, ...]


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer.

    `held_back`: the validation data are blocks held back from the training recordings. `selected` is what the patch adds, in
    order of adding; `units` of their parameters are filled. `model_xml`: the patched model's MJCF, parameters of the model
    corrected where they were found off by so little that no cause was named. `notes`: sentences that the reader needs.
    `fitted`: of axes whose gap the validation data do not show.
    """

    verdict: Verdict
    seed: int
    cutoff_hz: float
    standstill_velocity: Mapping[str, float]
    axes: Mapping[str, AxisGap]
    causes: tuple[Cause, ...]
    selected: tuple[PlacedEffect, ...]
    after_rms: Mapping[str, float]
    predictions: tuple[Prediction, ...]
    model_xml: str
    held_back: bool
    units: Mapping[str, str]
    notes: tuple[str, ...] = ()
    fitted: Mapping[str, FittedGap] = field(default_factory=dict)

    def shown_on(self, axis: str) -> Sequence[Prediction]:
        """Motion on which the axis's gap is told: the validation data, or where only the fitted show it, these."""
        return self.fitted[axis].predictions if axis in self.fitted else self.predictions

    def told(self, axis: str) -> tuple[AxisGap, float]:
        """The axis's gap and its rms after the patch, on that motion."""
        gap = self.axes[axis]
        if axis not in self.fitted:
            return gap, self.after_rms[axis]
        fitted = self.fitted[axis]
        return replace(gap, torque_rms=fitted.torque_rms, gap_rms=fitted.gap_rms), fitted.after_rms
