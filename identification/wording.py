"""The result in words and rounded figures: the same in the report and in the terminal."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

from drivetwin.foundation.quantities import with_interval
from drivetwin.identification.result import AxisIdentification, Identification, Parameter, Truth
from drivetwin.identification.truth import percent_error, true_value

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


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.2f} %"


SIZES = ("inertia", "coulomb", "viscous", "static_torque")
"""Parameters whose error in per cent says how well a torque is predicted."""
SHAPE = ("stribeck_velocity", "stribeck_exponent")
"""Parameters of the Stribeck curve's shape: wide intervals, for the torque hardly depends on them."""


@dataclass(frozen=True)
class Row:
    """One parameter as text: in a unit that fits, with the digits that its interval supports.

    `true`, `error` and `interval_holds` are empty where the truth is not known.
    """

    label: str
    value: str
    low: str
    high: str
    unit: str
    true: str
    error: str
    interval_holds: str


def row_of(name: str, parameter: Parameter, true: float | None) -> Row:
    """A parameter beside its true value."""
    texts, unit = with_interval(parameter.value, parameter.interval, parameter.unit, *([] if true is None else [true]))
    label = LABELS.get(name, name)
    value, low, high = texts[:3]
    if true is None:
        return Row(label, value, low, high, unit, "", "", "")
    error = percent_error(parameter.value, true)
    return Row(label, value, low, high, unit, texts[3], _signed(error), _interval_holds(parameter, true))


def _signed(error: float | None) -> str:
    return "" if error is None else f"{error:+.2f} %"


def _interval_holds(parameter: Parameter, true: float) -> str:
    """Whether the interval holds the true value, and by how much it misses it."""
    low, high = parameter.interval
    if low <= true <= high:
        return "yes"
    missed = percent_error(min(parameter.interval, key=lambda end: abs(end - true)), true)
    return "no" if missed is None else f"no, by {abs(missed):.2f} %"


def headline(identification: Identification, truth: Truth) -> str:
    """The errors in one sentence; empty where no truth is known."""
    errors = _errors(identification, truth, SIZES)
    if not errors:
        return ""
    shape = _held(identification, truth, SHAPE)
    held = _held(identification, truth, SIZES) + shape
    return (
        f"Errors of inertia and friction: {median(errors):.2f} % in the median, {max(errors):.2f} % at most. "
        f"{sum(held)} of {len(held)} intervals at {100 * identification.confidence:.0f} % contain the true value"
        f"{', including those of the shape of the Stribeck curve' if shape else ''}."
    )


def _held(identification: Identification, truth: Truth, names: tuple[str, ...]) -> list[bool]:
    """Of each of these parameters whose truth is known, on all axes: whether its interval contains it."""
    return [
        parameter.interval[0] <= true <= parameter.interval[1]
        for name, axis in identification.axes.items()
        for key in names
        if (parameter := axis.parameters.get(key)) and (true := true_value(truth.get(name, {}), key)) is not None
    ]


def _errors(identification: Identification, truth: Truth, names: tuple[str, ...]) -> list[float]:
    """Sizes of the errors [%] of these parameters on all axes."""
    found = (
        percent_error(axis.parameters[key].value, true_value(truth.get(name, {}), key))
        for name, axis in identification.axes.items()
        for key in names
        if key in axis.parameters
    )
    return [abs(error) for error in found if error is not None]


def summary_lines(identification: Identification) -> list[str]:
    """One sentence an axis."""
    return [_axis_line(axis) for axis in identification.axes.values()]


def _axis_line(axis: AxisIdentification) -> str:
    named = [
        f"{row.label} {row.value} {row.unit}"
        for key in ("inertia", "coulomb", "viscous")
        if key in axis.parameters and (row := row_of(key, axis.parameters[key], None))
    ]
    direction = ""
    if axis.direction:
        direction = "; friction depends on the direction" if axis.direction.real else "; the same friction in both directions"
    stribeck = "; friction rises towards low speed (Stribeck)" if axis.stribeck.real else ""
    checked = axis.validation_relative_error
    validation = f" ({percent(checked)} on validation recordings)" if checked is not None else ""
    return (
        f"{axis.axis}: {', '.join(named)}; relative error of the torque {percent(axis.relative_error)}{validation}"
        f"{direction}{stribeck}."
    )
