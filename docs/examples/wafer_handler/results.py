"""What `make wafer-handler` finds, as typed values, and as wafer-handler.json."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.feedforward.stage import Stage
from drivetwin.identification.friction_law import FrictionLaw
from wafer_handler.dynamics_check import DynamicsDifference, TorqueComparison
from wafer_handler.metrics import Tracking
from wafer_handler.scara.identification import BaseIdentification
from wafer_handler.scara.transfer import Phase

PUBLISHED = {
    "settling": {"lift": (336, 240), "rotate": (320, 160), "stretch": (176, 144)},
    "deceleration": {"lift": (496, 288), "rotate": (400, 144), "stretch": (304, 144)},
}
"""Table 2 of the paper: milliseconds without and with torque feed-forward."""

AXES = ("lift", "rotate", "stretch")


@dataclass(frozen=True)
class Times:
    """One of the paper's times [s], without torque feed-forward and with it."""

    without: float
    with_torque: float

    @property
    def ratio(self) -> float:
        """With over without."""
        return self.with_torque / self.without

    def to_json(self) -> dict[str, float | None]:
        """Milliseconds; null for a difference that has not come back into its band."""
        values = {"without_ms": 1e3 * self.without, "with_ms": 1e3 * self.with_torque, "ratio": self.ratio}
        return {name: value if isfinite(value) else None for name, value in values.items()}


@dataclass(frozen=True)
class AxisResult:
    """One axis's move at the paper's stages, with the friction of eq. 14 in the torque, and over the runs of the learning.

    `stages` have the whole identified model, Stribeck friction included; `eq14` Coulomb and viscous friction only. `learned`
    are the runs of a learning that starts from `eq14`, `learned_further` of one that starts from the last of the stages; the
    first of each has learned nothing.
    """

    stages: dict[Stage, Tracking]
    eq14: Tracking
    learned: list[Tracking]
    learned_further: list[Tracking]

    @property
    def baseline(self) -> float:
        """Greatest tracking difference with the velocity fed forward alone [m or rad]."""
        return self.stages[Stage.VELOCITY].peak

    @property
    def settling(self) -> Times:
        """Settling time."""
        return self._times(Tracking.settling_time)

    @property
    def deceleration(self) -> Times:
        """Deceleration time."""
        return self._times(Tracking.deceleration_time)

    @property
    def error_reduction(self) -> float:
        """By how much the torque lowers the greatest tracking difference."""
        return self.baseline / self.stages[Stage.TORQUE].peak

    @property
    def error_reduction_by_eq14(self) -> float:
        """The same with the friction of eq. 14 alone."""
        return self.baseline / self.eq14.peak

    @property
    def stages_of_eq14(self) -> dict[Stage, Tracking]:
        """The stages with the friction of eq. 14 in the last."""
        return {**self.stages, Stage.TORQUE: self.eq14}

    def _times(self, of: Callable[[Tracking, float], float]) -> Times:
        return times(of, self.stages)


def times(of: Callable[[Tracking, float], float], stages: dict[Stage, Tracking]) -> Times:
    """A time of the stages with velocity alone, which is the baseline, and with velocity and torque."""
    baseline = stages[Stage.VELOCITY]
    return Times(of(baseline, baseline.peak), of(stages[Stage.TORQUE], baseline.peak))


def learning_reduction(runs: list[Tracking]) -> float:
    """Greatest tracking difference of the first run over that of the last."""
    return runs[0].peak / runs[-1].peak


@dataclass(frozen=True)
class StraightMove:
    """The blade along a line at each stage: its true distance from the line (n,) [m] over time from the start (n,) [s]."""

    time: NDArray[np.float64]
    off: dict[Stage, NDArray[np.float64]]

    @property
    def straightness(self) -> float:
        """Greatest distance from the line with velocity and torque fed forward [m]."""
        return float(self.off[Stage.TORQUE].max())


@dataclass(frozen=True)
class CarriedPhase:
    """A phase of a transfer with a wafer on: how near it came to slipping, planned and as the blade truly moved."""

    phase: Phase
    seconds: float
    planned_margin: float
    true_margin: float


@dataclass(frozen=True)
class Study:
    """Everything; `by_offsets` are the stages on drives of the full CiA 402 profile, velocity and torque as 60B1h and 60B2h."""

    kinematics_error: float
    dynamics: DynamicsDifference
    compared: TorqueComparison
    identified: BaseIdentification
    eq14: BaseIdentification
    true_base: dict[str, float]
    true_laws: dict[str, FrictionLaw]
    axes: dict[str, AxisResult]
    by_offsets: dict[str, dict[Stage, Tracking]]
    straight: StraightMove
    carried: list[CarriedPhase]

    @property
    def base_errors(self) -> dict[str, float]:
        """How far each base parameter is from the plant's, as a share; a moment across a link as one of that along it."""
        true = self.true_base
        against = {**true, "forearm_moment_across": true["forearm_moment"], "blade_moment_across": true["blade_moment"]}
        return {name: (found.value - true[name]) / against[name] for name, found in self.identified.parameters.items()}

    def to_json(self) -> dict[str, Any]:
        """wafer-handler.json, without provenance."""
        return {
            "settling": {axis: result.settling.to_json() for axis, result in self.axes.items()},
            "deceleration": {axis: result.deceleration.to_json() for axis, result in self.axes.items()},
            "peak_error_reduction": {axis: result.error_reduction for axis, result in self.axes.items()},
            "learning_reduction": {axis: learning_reduction(result.learned) for axis, result in self.axes.items()},
            "with_eq14": {
                "settling": {
                    axis: times(Tracking.settling_time, result.stages_of_eq14).to_json() for axis, result in self.axes.items()
                },
                "deceleration": {
                    axis: times(Tracking.deceleration_time, result.stages_of_eq14).to_json()
                    for axis, result in self.axes.items()
                },
                "peak_error_reduction": {axis: result.error_reduction_by_eq14 for axis, result in self.axes.items()},
            },
            "learning_reduction_from_full_model": {
                axis: learning_reduction(result.learned_further) for axis, result in self.axes.items()
            },
            "dynamics_max_relative_difference": {"mujoco": self.dynamics.mujoco, "pinocchio": self.dynamics.pinocchio},
            "kinematics_max_error_m": self.kinematics_error,
            "blade_straightness_m": self.straight.straightness,
            "base_parameters": {
                name: {**parameter.to_json(), "true": self.true_base[name]}
                for name, parameter in self.identified.parameters.items()
            },
            "base_parameter_max_relative_error": max(abs(error) for error in self.base_errors.values()),
            "wafer_least_slip_margin": min(phase.true_margin for phase in self.carried),
        }
