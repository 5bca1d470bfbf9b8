"""The sections on how the answer came about: filter, noise, test, definitions, settings, inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from html import escape

import numpy as np

from drivetwin.diagnosis.report.result import AxisGap, Diagnosis
from drivetwin.diagnosis.report.wording import level, name_of, p_words
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.page_table import plain_table, stacking_table
from drivetwin.foundation.quantities import number, quantity
from drivetwin.motion.filtering import effective_cutoff

_UNITS = {"cutoff_hz": "Hz", "timing_spread": "s"}
"""Of settings that are no pure numbers."""


def method_section(diagnosis: Diagnosis) -> str:
    """Per axis what was compared and how, then what the words mean."""
    head = ["Axis", "Cut-off", "In motion above", "Noise, rms", "Model error, rms", "At standstill, rms", "Test"]
    rows = [_axis(name, gap, diagnosis) for name, gap in diagnosis.axes.items()]
    noise = "".join(
        f"<li>Noise of {escape(', '.join(axes))}: {escape(found)}.</li>"
        for found, axes in _axes_by({name: gap.noise_found_by for name, gap in diagnosis.axes.items()}).items()
    )
    names = dict.fromkeys(gap.test for gap in diagnosis.axes.values())
    tests = "".join(f"<li>Is there a gap? {escape(test)}.</li>" for test in names)
    return (
        f"<section><h2>Method</h2>{stacking_table(head, rows, numeric=range(1, 7))}<ul>"
        "<li>Measured and predicted torque go through the same zero-phase 4th-order Butterworth filter, forward and backward; "
        f"the cut-off is its -3 dB frequency of one pass{_lowered(diagnosis)}.</li>"
        "<li>Only samples in motion count: at standstill stiction holds an arbitrary torque, and the gap there is listed "
        "separately.</li>"
        f"{noise}<li>Model error is what a model of this kind is expected to miss. It is not noise, and is listed "
        "separately.</li>"
        f"{tests}"
        "<li>Regimes: a sample in motion counts in the first that fits, in the order of the table; shares are of the gap's "
        "energy above noise.</li>"
        "<li>The gap varies over: what goes with a quantity beyond the axis's own direction, speed and acceleration, "
        "cross-validated. Each has its own share; the shares do not add up.</li></ul>"
        f"<h3>Settings</h3>{_settings(diagnosis.settings)}</section>"
    )


def _axis(name: str, gap: AxisGap, diagnosis: Diagnosis) -> list[str]:
    unit, speed = diagnosis.units[name], gap.standstill_velocity
    return [
        escape(name),
        f"{number(gap.cutoff_hz)} Hz",
        quantity(speed, "m/s" if unit == "N" else "rad/s", 3) if np.isfinite(speed) else "never moves",
        level(gap.noise_rms, unit),
        level(gap.model_error_rms, unit),
        level(gap.standstill_rms, unit),
        escape(p_words(gap.p_value)),
    ]


def _lowered(diagnosis: Diagnosis) -> str:
    """Where a recording's sample rate cannot have the cut-off."""
    highest = max(gap.cutoff_hz for gap in diagnosis.axes.values())
    lowest = min(effective_cutoff(prediction.period, highest) for prediction in diagnosis.predictions)
    return f", lowered to 0.4 of the sample rate where that is less ({number(lowest)} Hz)" if lowest < highest else ""


def _axes_by(words: Mapping[str, str]) -> dict[str, list[str]]:
    """Axes of which the same is said."""
    found: dict[str, list[str]] = {}
    for axis, said in words.items():
        found.setdefault(said, []).append(axis)
    return found


def _settings(settings: Settings) -> str:
    rows = [[escape(name_of(name)), _value(name, value)] for name, value in asdict(settings).items()]
    note = '<p class="note">docs/diagnosis.md explains each setting, and how much the answer depends on it.</p>'
    return f"{plain_table(['Setting', 'Value'], rows, numeric=(1,))}{note}"


def _value(name: str, value: float | int | None) -> str:
    if value is None:
        return "chosen from the recordings"
    return quantity(value, _UNITS[name]) if name in _UNITS else f"{value:g}"
