"""A diagnosis of two axes made by hand, and the recordings that it is drawn from, for tests of the report."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from scipy import signal

from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.report.result import (
    Array,
    AxisGap,
    AxisPrediction,
    Cause,
    CorrectedMass,
    Diagnosis,
    Estimate,
    Pattern,
    Prediction,
    Regime,
    RegimeName,
    Share,
    Shrink,
    Unknown,
    Verdict,
)
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import PlacedEffect, library

PERIOD, CUTOFF, STANDSTILL, NOISE = 1e-3, 48.0, 0.002, 0.02


def time_of(seconds: float) -> Array:
    """Sample times [s] at 1 kHz."""
    return np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD


def coloured_noise(count: int, rms: float, seed: int = 0) -> Array:
    """White noise through the filter that torque and prediction go through, of this expected rms."""
    sections = signal.butter(4, CUTOFF, fs=1.0 / PERIOD, output="sos")
    _, response = signal.sosfreqz(sections, 8192)
    noise = signal.sosfiltfilt(sections, np.random.default_rng(seed).standard_normal(count + 2000))[1000:-1000]
    return np.asarray(rms * noise / np.sqrt(np.mean(np.abs(response) ** 4)), dtype=np.float64)


def swinging(time: Array) -> tuple[Array, Array, Array]:
    """Position, velocity, acceleration of two swings at once, so that every place sees many speeds."""
    angle = 0.5 * np.pi * time
    position = 0.35 * np.sin(angle) + 0.65 * np.sin(0.31 * angle + 1.0)
    velocity = np.gradient(position, PERIOD)
    return position, velocity, np.gradient(velocity, PERIOD)


def axis_of(time: Array, gap: Array, after: Array | None = None) -> AxisPrediction:
    """An axis that swings, measured with `gap` more than simulated; `after` is what the patch leaves."""
    position, velocity, acceleration = swinging(time)
    before = 2.0 * acceleration + np.sign(velocity) + 0.3 * velocity
    measured = before + gap
    used = np.abs(velocity) > STANDSTILL
    used[:30] = used[-30:] = False
    patched = measured - (np.zeros_like(gap) if after is None else after)
    return AxisPrediction(before, patched, measured, used, position, velocity, acceleration)


def recording_of(time: Array, gap: Array, name: str = "swing") -> Prediction:
    """A validation recording of one axis, rotate."""
    return Prediction(name, time, {"rotate": axis_of(time, gap)})


def slowly(run: Prediction, every: int) -> Prediction:
    """The same recorded at a lower rate."""
    parts = {
        axis: AxisPrediction(**{one.name: getattr(found, one.name)[::every] for one in fields(found)})
        for axis, found in run.axes.items()
    }
    return Prediction(run.recording, run.time[::every], parts)


def placed(name: str, axis: str = "rotate", **parameters: float) -> PlacedEffect:
    return PlacedEffect(axis, library()[name](**parameters), dict.fromkeys(parameters, "1"))


def estimates(**values: tuple[float, str]) -> dict[str, Estimate]:
    """Parameters whose 90 % interval is a tenth to either side."""
    return {name: Estimate(value, unit, (0.9 * value, 1.1 * value)) for name, (value, unit) in values.items()}


STRIBECK = placed("stribeck", static_torque=1.3, stribeck_velocity=0.05, exponent=1.0)
RIPPLE = placed("torque_ripple", amplitude=0.11, order=24.0, phase=0.4)
SLOW = "slow constant-velocity strokes, below a tenth of the top speed"
ANY_PHASE = Cause(
    "torque_ripple", "rotate", 0.9, 0.2,
    estimates(amplitude=(0.11, "N·m")) | {"phase": Estimate(-2.32, "rad", (-2.32 - np.pi, -2.32 + np.pi))}, None,
)  # fmt: skip
LIGHTER = CorrectedMass("forearm", "rotate", Estimate(1.08, "kg", (1.05, 1.11)), 1.2, 0.14, Shrink(0.14, (0.1, 0.2), 0.15))
CAUSES = (
    Cause(
        "stribeck", "rotate", 0.97, 0.62,
        estimates(static_torque=(1.3, "N·m"), stribeck_velocity=(0.05, "rad/s"), exponent=(1.0, "1")),
        Shrink(0.63, (0.58, 0.67), 0.66), ("presliding",), SLOW, "an encoder on the joint",
    ),
    Cause(
        "torque_ripple", "rotate", 0.99, 0.18,
        estimates(amplitude=(0.11, "N·m"), order=(24.0, "1"), phase=(0.4, "rad")),
        Shrink(0.18, (0.15, 0.2), 0.19),
    ),
    Cause("unknown", "rotate", 0.93, 0.09, {}, None),
    Cause(
        "spring", "rotate", 0.66, 0.07, estimates(stiffness=(0.31, "N·m/rad"), rest=(0.1, "rad")),
        Shrink(0.07, (0.03, 0.1), None),
    ),
    Cause("presliding", "rotate", 0.06, 0.05, {}, None),
    Cause("delay", "rotate", 0.03, 0.01, {}, None),
)  # fmt: skip
SHARES = (
    Share("stribeck", 0.62, (0.58, 0.66)),
    Share("torque_ripple", 0.18, (0.15, 0.2)),
    Share("spring", 0.07, (0.04, 0.09)),
    Share("unknown", 0.09, (0.05, 0.12)),
    Share("noise", 0.04, (0.03, 0.05)),
)
ONE_WAY = ("motion in one direction only", "the same strokes in the other direction")
NOT_TESTABLE = (
    NotTestable("coulomb_asymmetry", *ONE_WAY),
    NotTestable("temperature_drift", "too short", "`start_time` in recording.json, or longer"),
    NotTestable("viscous_asymmetry", *ONE_WAY),
)


def gap_of(gap_rms: float, significant: bool) -> AxisGap:
    """An axis with all that a gap can have, or one with none of it."""
    regimes: dict[RegimeName, tuple[float, dict[str, tuple[float, float]]]] = {
        "reversal": (0.1, {"time": (-0.05, 0.05)}),
        "presliding": (0.03, {"displacement": (0.0, 0.017)}),
        "acceleration": (0.06, {"acceleration": (0.54, 1.3)}),
        "low_speed": (0.71, {"velocity": (-0.19, 0.19)}),
        "high_speed": (0.1, {"speed": (0.19, 0.77)}),
    }
    where = tuple(Regime(name, share, bounds) for name, (share, bounds) in regimes.items())
    return AxisGap(
        cutoff_hz=CUTOFF,
        standstill_velocity=STANDSTILL,
        torque_rms=1.31,
        gap_rms=gap_rms,
        noise_rms=NOISE,
        noise_found_by="spectrum of the torque above 3 cut-offs",
        model_error_rms=0.016,
        standstill_rms=0.1,
        significant=significant,
        test="gap against noise, in blocks of a second",
        p_value=1e-30 if significant else 0.41,
        shares=SHARES if significant else (Share("unknown", 0.02, (0.0, 0.1)), Share("noise", 0.98, (0.9, 1.0))),
        where=where,
        where_after=(replace(where[0], share=0.8), replace(where[3], share=0.2)) if significant else (),
        patterns=(Pattern("position", 0.18, "period 15 deg"),) if significant else (),
        unknown=Unknown(0.09, ("position", "cross_axis"), 0.21) if significant else Unknown(0.02, (), 0.0),
        not_testable=NOT_TESTABLE if significant else (),
    )


def two_axes(seconds: float = 20.0) -> Diagnosis:
    """`rotate` has a gap of three effects, something unknown and noise; `stretch` has noise."""
    time = time_of(seconds)
    position, velocity, _ = swinging(time)
    noise = coloured_noise(len(time), NOISE, 1)
    unknown = np.where(position > 0.6, 0.12 * np.sin(30.0 * position), 0.0)
    found = 0.5 * np.exp(-np.abs(velocity) / 0.12) * np.sign(velocity) + 0.11 * np.sin(24.0 * position) + 0.05 * position
    axes = {"rotate": axis_of(time, found + unknown + noise, unknown + noise), "stretch": axis_of(time, noise, noise)}
    rms = {name: float(np.sqrt(np.mean((one.measured - one.before)[one.used] ** 2))) for name, one in axes.items()}
    after = {name: float(np.sqrt(np.mean((one.measured - one.after)[one.used] ** 2))) for name, one in axes.items()}
    return Diagnosis(
        verdict=Verdict.PARTLY_EXPLAINED,
        settings=Settings(),
        axes={"rotate": gap_of(rms["rotate"], True), "stretch": gap_of(rms["stretch"], False)},
        causes=CAUSES,
        selected=(STRIBECK, RIPPLE, placed("spring", stiffness=0.31, rest=0.1)),
        after_rms=after,
        predictions=(Prediction("sweep", time, axes),),
        model_xml="<mujoco/>",
        held_back=False,
        units={"rotate": "N·m", "stretch": "N"},
        notes=("the friction of the model was 3 % low",),
    )


CASE = two_axes()


def small(found: Diagnosis) -> Diagnosis:
    """A case of a machine of a thousandth of the torque."""
    axes = {
        name: replace(gap, torque_rms=1e-3 * gap.torque_rms, gap_rms=1e-3 * gap.gap_rms, noise_rms=1e-3 * gap.noise_rms)
        for name, gap in found.axes.items()
    }
    return replace(found, axes=axes, after_rms={name: 1e-3 * after for name, after in found.after_rms.items()})
