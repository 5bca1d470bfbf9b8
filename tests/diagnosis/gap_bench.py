"""Motions and gaps made by hand, for tests that know what has to come out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
from scipy import signal

from diagnosis import gap_test
from diagnosis.report.patterns import patterns
from diagnosis.report.result import (
    Array,
    AxisGap,
    AxisPrediction,
    Cause,
    Diagnosis,
    Estimate,
    FittedGap,
    Prediction,
    Shrink,
    Verdict,
)
from diagnosis.report.where import regimes
from emulator.effects import PlacedEffect, library

PERIOD, CUTOFF, STANDSTILL = 1e-3, 48.0, 0.002


def time_of(seconds: float) -> Array:
    """Sample times [s] at 1 kHz."""
    return np.arange(round(seconds / PERIOD)) * PERIOD


def coloured_noise(rng: np.random.Generator, count: int, rms: float) -> Array:
    """White noise through the filter that torque and prediction go through, of this expected rms."""
    sections = signal.butter(4, CUTOFF, fs=1.0 / PERIOD, output="sos")
    _, response = signal.sosfreqz(sections, 8192)
    noise = signal.sosfiltfilt(sections, rng.standard_normal(count + 2000))[1000:-1000]
    return np.asarray(rms * noise / np.sqrt(np.mean(np.abs(response) ** 4)), dtype=np.float64)


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
    gaps, after = {}, {}
    for axis in axes:
        used = [run.axes[axis].used for run in predictions]
        measured, before, patched = (
            np.concatenate([getattr(run.axes[axis], name)[mask] for run, mask in zip(predictions, used, strict=True)])
            for name in ("measured", "before", "after")
        )
        noise = 0.02
        after[axis] = float(np.sqrt(np.mean((measured - patched) ** 2)))
        gaps[axis] = AxisGap(
            torque_rms=float(np.sqrt(np.mean(measured**2))),
            gap_rms=float(np.sqrt(np.mean((measured - before) ** 2))),
            noise_rms=noise,
            noise_found_by="spectrum above the filter",
            standstill_rms=0.1,
            significant=bool(np.mean((measured - before) ** 2) > 4.0 * noise**2),
            test=gap_test.NAME,
            p_value=gap_test.significance(predictions, axis, noise, CUTOFF),
            where=regimes(predictions, axis, noise, STANDSTILL),
            patterns=patterns(predictions, axis, noise, CUTOFF, "N·m"),
        )
    return Diagnosis(
        verdict=Verdict.EXPLAINED,
        seed=3,
        cutoff_hz=CUTOFF,
        standstill_velocity=dict.fromkeys(axes, STANDSTILL),
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


STRIBECK = PlacedEffect(
    "rotate",
    library()["stribeck"](static_torque=1.3, stribeck_velocity=0.05, exponent=1.0),  # type: ignore[call-arg]
    {"static_torque": "N·m", "stribeck_velocity": "rad/s", "exponent": "1"},
)

CAUSES = (
    Cause(
        1, "stribeck", "rotate", 0.91,
        {
            "static_torque": Estimate(1.3, "N·m", (1.2, 1.4)),
            "stribeck_velocity": Estimate(0.05, "rad/s", (0.04, 0.061)),
            "exponent": Estimate(1.0, "1", (0.8, 1.3)),
        },
        Shrink(0.97, (0.96, 0.98), 0.99), ("presliding",), "slow constant-velocity sweeps below 0.05 rad/s",
    ),
    Cause(
        1, "presliding", "rotate", 0.06,
        {"stiffness": Estimate(310.0, "N·m/rad", (200.0, 500.0))},
        Shrink(0.4, (0.3, 0.5), 0.41),
    ),
    Cause(1, "unknown", "rotate", 0.02, {}, None),
    Cause(1, "none", None, 0.01, {}, None),
    Cause(2, "none", None, 0.8, {}, None),
    Cause(2, "unknown", "stretch", 0.2, {}, None),
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


def died_out_case(seconds: float = 20.0) -> Diagnosis:
    """The same two axes, but the validation data show no gap: `rotate` has its gap on the fitted recording `before` alone."""
    rng = np.random.default_rng(6)
    time = time_of(seconds)
    held = {axis: axis_of(time, coloured_noise(rng, len(time), 0.02)) for axis in ("rotate", "stretch")}
    shown = stribeck_case(seconds)
    fitted, gap = replace(shown.predictions[0], recording="before"), shown.axes["rotate"]
    found = diagnosis_of((recording_of(time, held, "warm"),), (STRIBECK,), CAUSES)
    axes = {**found.axes, "rotate": replace(found.axes["rotate"], significant=True, where=gap.where, patterns=gap.patterns)}
    only = FittedGap(gap.torque_rms, gap.gap_rms, shown.after_rms["rotate"], (fitted,))
    return replace(found, axes=axes, fitted={"rotate": only})
