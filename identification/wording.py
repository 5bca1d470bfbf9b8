"""The result in words and rounded figures: the same in the report and in the terminal."""

from __future__ import annotations

from drivetwin.identification.result import AxisIdentification, Identification, Truth
from drivetwin.identification.truth import percent_error

LABELS = {
    "inertia": "inertia",
    "coulomb": "Coulomb friction",
    "viscous": "viscous friction",
    "offset": "offset",
    "model_scale": "scale of the model's other torque",
    "delay": "delay of motion behind torque",
    "static_torque": "static friction",
    "stribeck_velocity": "Stribeck velocity",
    "stribeck_exponent": "Stribeck exponent",
    "coulomb_positive": "Coulomb friction, forwards",
    "coulomb_negative": "Coulomb friction, backwards",
    "viscous_positive": "viscous friction, forwards",
    "viscous_negative": "viscous friction, backwards",
}


def number(value: float) -> str:
    """Five significant digits."""
    return f"{value:.5g}"


def summary_lines(identification: Identification, truth: Truth) -> list[str]:
    """One sentence an axis, and how the whole compares with the truth where there is one."""
    lines = [_axis_line(axis) for axis in identification.axes.values()]
    compared = [
        (parameter.interval[0] <= true <= parameter.interval[1], percent_error(parameter.value, true))
        for name, axis in identification.axes.items()
        for key, parameter in axis.parameters.items()
        if key in ("coulomb", "viscous") and (true := truth.get(name, {}).get(key)) is not None
    ]
    errors = [abs(error) for _, error in compared if error is not None]
    if errors:
        inside = sum(hit for hit, _ in compared)
        lines.append(
            f"Against the truth: largest error of a Coulomb or viscous coefficient {max(errors):.2f} %; {inside} of "
            f"{len(compared)} lie in their {identification.confidence:.0%} interval."
        )
    return lines


def _axis_line(axis: AxisIdentification) -> str:
    named = [
        f"{LABELS[key]} {number(axis.parameters[key].value)} {axis.parameters[key].unit}"
        for key in ("inertia", "coulomb", "viscous")
        if key in axis.parameters
    ]
    direction = ""
    if axis.direction:
        direction = "; direction dependence is real" if axis.direction.real else "; no direction dependence"
    stribeck = "; friction rises towards low speed (Stribeck)" if axis.stribeck.real else ""
    checked = axis.validation_relative_error
    validation = f", {checked:.2%} on validation" if checked is not None else ""
    return f"{axis.axis}: {', '.join(named)}; relative error {axis.relative_error:.2%}{validation}{direction}{stribeck}."
