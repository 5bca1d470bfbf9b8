"""The result of the identification: typed, and as the `identified/1` object of the contract."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from drivetwin.foundation.files import provenance
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.settings import Settings
from drivetwin.identification.strokes import Stroke
from drivetwin.motion.inverse_dynamics import JointKind
from drivetwin.motion.moving import AxisSamples
from drivetwin.recording.recording import Samples

SCHEMA = "identified/1"

Truth = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Units:
    """Of one kind of joint; `word` is what its torque is called."""

    inertia: str
    torque: str
    viscous: str
    velocity: str
    word: str


UNITS = {
    JointKind.REVOLUTE: Units("kg·m²", "N·m", "N·m·s/rad", "rad/s", "torque"),
    JointKind.PRISMATIC: Units("kg", "N", "N·s/m", "m/s", "force"),
}


@dataclass(frozen=True)
class Parameter:
    """An estimate with its interval (two-sided, at the confidence of the settings)."""

    value: float
    unit: str
    interval: tuple[float, float]

    def moved(self, by: float) -> Parameter:
        """The parameter plus a constant."""
        return Parameter(self.value + by, self.unit, (self.interval[0] + by, self.interval[1] + by))

    def to_json(self) -> dict[str, Any]:
        """As in the contract."""
        return {"value": self.value, "unit": self.unit, "ci90": list(self.interval)}


@dataclass(frozen=True)
class Test:
    """Whether a term of the friction law is real: significant, and a gain on held-out data.

    `gain` is the share of the cross-validated residual energy that the term removes; `note` is the verdict in words.
    """

    __test__ = False

    real: bool
    name: str
    statistic: float
    p_value: float
    gain: float
    note: str

    def to_json(self) -> dict[str, Any]:
        """The verdict and the test behind it."""
        test = {
            "name": self.name,
            "statistic": self.statistic,
            "p_value": self.p_value,
            "cross_validated_gain": self.gain,
        }
        return {"real": self.real, "test": test, "note": self.note}


@dataclass(frozen=True)
class Trace:
    """One recording of an axis beside the fit: `residual` (n,) = measured - model torque, both filtered."""

    samples: AxisSamples
    residual: Samples
    validation: bool


@dataclass(frozen=True)
class AxisIdentification:
    """The result for one axis.

    `law` and `directional_law` are the fitted friction; `unidentifiable` gives the reason for each missing parameter.
    """

    axis: str
    joint: str
    kind: JointKind
    parameters: dict[str, Parameter]
    unidentifiable: dict[str, str]
    relative_error: float
    relative_error_directional: float | None
    validation_relative_error: float | None
    validation_relative_error_directional: float | None
    direction: Test | None
    stribeck: Test
    minimum_velocity: float | None
    standstill_velocity: float
    law: FrictionLaw
    directional_law: FrictionLaw | None
    strokes: tuple[Stroke, ...]
    traces: tuple[Trace, ...] = field(repr=False)

    @property
    def units(self) -> Units:
        """Of this axis."""
        return UNITS[self.kind]

    @property
    def best_offset(self) -> float:
        """Offset of the law that holds: the direction-dependent one where that is real [N·m or N]."""
        real = self.direction is not None and self.direction.real
        return self.directional_law.offset if real and self.directional_law is not None else self.law.offset

    def to_json(self, truth: Mapping[str, float] | None) -> dict[str, Any]:
        """One entry of `axes`."""
        optional = {
            "relative_error_directional": self.relative_error_directional,
            "validation_relative_error": self.validation_relative_error,
            "validation_relative_error_directional": self.validation_relative_error_directional,
            "direction": self.direction.to_json() if self.direction else None,
            "not_identifiable": self.unidentifiable or None,
            "truth": dict(truth) if truth else None,
        }
        return {
            "joint": self.joint,
            "parameters": {name: parameter.to_json() for name, parameter in self.parameters.items()},
            "relative_error": self.relative_error,
            "stribeck": self.stribeck.to_json() | {"minimum_velocity": self.minimum_velocity},
            "strokes": [stroke.to_json() for stroke in self.strokes],
        } | {key: value for key, value in optional.items() if value is not None}


@dataclass(frozen=True)
class Identification:
    """The result for a machine; `skipped` gives the reason for each recorded axis without a result."""

    machine: str
    axes: dict[str, AxisIdentification]
    skipped: dict[str, str]
    settings: Settings
    lowered_cutoffs: dict[str, float]

    @property
    def confidence(self) -> float:
        """Of all intervals."""
        return self.settings.confidence

    def to_json(
        self, truth: Truth | None = None, seed: int = 0, inputs: Sequence[Path] = (), root: Path | None = None
    ) -> dict[str, Any]:
        """The `identified/1` object.

        `truth` is by axis and parameter; `inputs` are the files that the fit read, named relative to `root`.
        """
        known = truth or {}
        filtering: dict[str, Any] = {
            "name": "zero-phase 4th-order Butterworth, forward and backward",
            "cutoff_hz": self.settings.cutoff_hz,
            "standstill_velocity": {name: axis.standstill_velocity for name, axis in self.axes.items()},
            "reversal_margin": self.settings.reversal_margin,
        }
        if self.lowered_cutoffs:
            filtering["lowered_cutoff_hz"] = self.lowered_cutoffs
        payload: dict[str, Any] = {
            "schema": SCHEMA,
            **provenance(seed, inputs, root),
            "machine": self.machine,
            "filter": filtering,
            "settings": asdict(self.settings),
            "confidence": self.confidence,
            "axes": {name: axis.to_json(known.get(name)) for name, axis in self.axes.items()},
        }
        if self.skipped:
            payload["skipped"] = self.skipped
        return payload
