"""Motions and gaps made by hand, for tests that know what has to come out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import cache

import numpy as np
from scipy import signal

from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.report.gap_test import NAME, Errs, significance
from drivetwin.diagnosis.report.patterns import patterns
from drivetwin.diagnosis.report.result import (
    Array,
    AxisGap,
    AxisPrediction,
    Cause,
    Diagnosis,
    Estimate,
    Prediction,
    Share,
    Shrink,
    Unknown,
    Verdict,
)
from drivetwin.diagnosis.report.where import regimes
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import PlacedEffect, library

PERIOD, CUTOFF, STANDSTILL = 1e-3, 48.0, 0.002


def time_of(seconds: float) -> Array:
    """Sample times [s] at 1 kHz."""
    return np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD


def coloured_noise(rng: np.random.Generator, count: int, rms: float) -> Array:
    """White noise through the filter that torque and prediction go through, of this expected rms."""
    sections, gain = _colour()
    noise = signal.sosfiltfilt(sections, rng.standard_normal(count + 2000))[1000:-1000]
    return np.asarray(rms * noise / gain, dtype=np.float64)


@cache
def _colour() -> tuple[Array, float]:
    """The filter's sections, and the rms that it leaves of white noise of 1, there and back."""
    sections = signal.butter(4, CUTOFF, fs=1.0 / PERIOD, output="sos")
    _, response = signal.sosfreqz(sections, 8192)
    return sections, float(np.sqrt(np.mean(np.abs(response) ** 4)))


def swinging(time: Array, amplitude: float = 1.0, frequency: float = 0.25) -> tuple[Array, Array, Array]:
    """Position, velocity, acceleration of two swings at once, so that every place sees many speeds and accelerations."""
    angle = 2.0 * np.pi * frequency * time
    position = amplitude * (0.35 * np.sin(angle) + 0.65 * np.sin(0.31 * angle + 1.0))
    velocity = np.gradient(position, PERIOD)
    return position, velocity, np.gradient(velocity, PERIOD)


def axis_of(
    time: Array, gap: Array, simulated: Array | None = None, after: Array | None = None, frequency: float = 0.25
) -> AxisPrediction:
    """An axis that swings, simulated with `simulated` [N·m], measured with `gap` more; `after` is what the patch leaves."""
    position, velocity, acceleration = swinging(time, frequency=frequency)
    before = 2.0 * acceleration + np.sign(velocity) + 0.3 * velocity if simulated is None else simulated
    measured = before + gap
    left = np.zeros_like(gap) if after is None else after
    used = np.abs(velocity) > STANDSTILL
    used[:30] = used[-30:] = False
    return AxisPrediction(before, measured - left, measured, used, position, velocity, acceleration)


def recording_of(time: Array, axes: Mapping[str, AxisPrediction], name: str = "swing") -> Prediction:
    """A validation recording of these axes."""
    return Prediction(name, time, dict(axes))


def slowly(run: Prediction, every: int) -> Prediction:
    """The same recorded at a lower rate."""
    parts = {
        axis: AxisPrediction(**{one.name: getattr(found, one.name)[::every] for one in fields(found)})
        for axis, found in run.axes.items()
    }
    return Prediction(run.recording, run.time[::every], parts)


def diagnosis_of(
    predictions: tuple[Prediction, ...], selected: tuple[PlacedEffect, ...], causes: tuple[Cause, ...]
) -> Diagnosis:
    """A diagnosis of these predictions; its levels are their own, patterns and regimes as the product finds them."""
    axes = list(predictions[0].axes)
    gaps = {axis: gap_of_axis(predictions, axis, selected) for axis in axes}
    after = {axis: rms(predictions, axis, "after") for axis in axes}
    return Diagnosis(
        verdict=Verdict.EXPLAINED,
        settings=Settings(seed=3),
        axes=gaps,
        causes=causes,
        selected=selected,
        after_rms=after,
        predictions=predictions,
        model_xml="<mujoco/>",
        held_back=False,
        units=dict.fromkeys(axes, "N·m"),
        notes=("the friction of the model was 3 % low",),
    )


def gap_of_axis(predictions: tuple[Prediction, ...], axis: str, selected: tuple[PlacedEffect, ...]) -> AxisGap:
    """Levels by plain numpy; what is left beyond noise is unknown, all else the first effect's of the axis."""
    used = np.concatenate([run.axes[axis].measured[run.axes[axis].used] for run in predictions])
    gap, after = rms(predictions, axis, "before"), rms(predictions, axis, "after")
    noise = min(0.02**2 / gap**2, 1.0)
    unknown = min(max((after**2 - 0.02**2) / gap**2, 0.0), 1.0 - noise)
    names = [one.effect.name for one in selected if one.axis == axis]
    parts = [(name, (1.0 - noise - unknown) / len(names)) for name in names]
    shares = [*parts, ("unknown", unknown if parts else 1.0 - noise), ("noise", noise)]
    return AxisGap(
        cutoff_hz=CUTOFF,
        standstill_velocity=STANDSTILL,
        torque_rms=float(np.sqrt(np.mean(used**2))),
        gap_rms=gap,
        noise_rms=0.02,
        noise_found_by="spectrum above the filter",
        model_error_rms=0.01,
        standstill_rms=0.1,
        significant=bool(gap > 0.04),
        test=NAME,
        p_value=significance(predictions, axis, Errs(0.02), CUTOFF),
        shares=tuple(Share(name, share, (0.9 * share, min(1.1 * share, 1.0))) for name, share in shares),
        where=regimes(predictions, axis, 0.02, STANDSTILL),
        where_after=(),
        patterns=patterns(predictions, axis, 0.02, CUTOFF, "N·m"),
        unknown=Unknown(shares[-2][1], ("velocity",), 0.2),
        not_testable=(NotTestable("spring", "the position is relative", "an absolute position"),),
    )


def rms(predictions: tuple[Prediction, ...], axis: str, of: str) -> float:
    """Of measured less predicted over the samples in use [N·m or N]."""
    parts = [run.axes[axis] for run in predictions]
    return float(np.sqrt(np.mean(np.concatenate([(part.measured - getattr(part, of))[part.used] for part in parts]) ** 2)))


STRIBECK = PlacedEffect(
    "rotate",
    library()["stribeck"](static_torque=1.3, stribeck_velocity=0.05, exponent=1.0),  # type: ignore[call-arg]
    {"static_torque": "N·m", "stribeck_velocity": "rad/s", "exponent": "1"},
)

CAUSES = (
    Cause(
        "stribeck", "rotate", 0.91, 0.9,
        {
            "static_torque": Estimate(1.3, "N·m", (1.2, 1.4)),
            "stribeck_velocity": Estimate(0.05, "rad/s", (0.04, 0.061)),
            "exponent": Estimate(1.0, "1", (0.8, 1.3)),
        },
        Shrink(0.97, (0.96, 0.98), 0.99), ("presliding",), "slow constant-velocity sweeps below 0.05 rad/s",
        "an encoder on the joint",
    ),
    Cause("presliding", "rotate", 0.06, 0.4, {}, None),
    Cause("unknown", "rotate", 0.02, 0.05, {}, None),
)  # fmt: skip


def stribeck_case(seconds: float = 60.0) -> Diagnosis:
    """Two axes: `rotate` lacks Stribeck friction in the simulation and gets it, `stretch` is right."""
    rng = np.random.default_rng(5)
    time = time_of(seconds)
    _, velocity, _ = swinging(time)
    noise = coloured_noise(rng, len(time), 0.02)
    gap = 0.9 * np.exp(-np.abs(velocity) / 0.12) * np.sign(velocity)
    axes = {
        "rotate": axis_of(time, gap + noise, after=noise),
        "stretch": axis_of(time, noise, after=noise, frequency=0.41),
    }
    return diagnosis_of((recording_of(time, axes, "sweep"),), (STRIBECK,), CAUSES)
