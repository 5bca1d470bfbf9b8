"""What `drivetwin identify` says in the terminal: the friction found beside the true one, and the witness by SDO."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from drivetwin.controller.procedure import Captured
from drivetwin.controller.sdo_check import FrictionPoint
from drivetwin.identification import Identification, Parameter, Truth
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.truth import true_value


def print_summary(console: Console, found: Identification, truth: Truth | None, captured: Captured, out: Path) -> None:
    """Tables, figures of the capture, and where the files are."""
    console.print(_parameters(found, truth or {}))
    for name, axis in found.axes.items():
        if axis.direction is not None and axis.direction.real:
            forwards, backwards = (axis.parameters[f"viscous_{way}"] for way in ("positive", "negative"))
            console.print(
                f"{name}: friction depends on the direction: viscous {forwards.value:.4g} forwards, {backwards.value:.4g} "
                f"{forwards.unit} backwards; the symmetric law above is a compromise",
                highlight=False,
            )
    console.print(_witness(found, captured.sdo_points))
    late = ""
    if captured.late_cycles:
        late = f"; {captured.late_cycles} cycles were late, by {1e3 * captured.worst_lateness:.1f} ms at worst"
    console.print(f"{captured.cycles} cycles of {1e3 * captured.period:g} ms{late}", highlight=False)
    console.print(f"{out / 'report.html'}  {out / 'identified.json'}  {out / 'bus.log'}", highlight=False, soft_wrap=True)


SHOWN = ("inertia", "coulomb", "viscous", "offset", "static_torque", "stribeck_velocity", "stribeck_exponent")
"""Parameters in the terminal; the report has the direction-dependent ones as well."""


def _parameters(found: Identification, truth: Truth) -> Table:
    table = Table(title="Identified over the bus", title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("axis", "parameter"):
        table.add_column(name, no_wrap=True)
    for name in ("identified", "90 % interval", "unit", *(("true", "error", "inside") if truth else ())):
        table.add_column(name, no_wrap=True, justify="left" if name == "unit" else "right")
    for axis_name, axis in found.axes.items():
        shown = {name: axis.parameters[name] for name in SHOWN if name in axis.parameters}
        for row, (name, parameter) in enumerate(shown.items()):
            cells = [axis_name if row == 0 else "", name, f"{parameter.value:.4g}", _interval(parameter), parameter.unit]
            table.add_row(*cells, *(_against(parameter, true_value(truth[axis_name], name)) if truth else []))
        table.add_section()
    return table


def _interval(parameter: Parameter) -> str:
    return f"{parameter.interval[0]:.4g} .. {parameter.interval[1]:.4g}"


def _against(parameter: Parameter, true: float | None) -> list[str]:
    """True value, error and whether the interval holds it."""
    if true is None:
        return ["", "", ""]
    inside = parameter.interval[0] <= true <= parameter.interval[1]
    error = f"{100.0 * (parameter.value / true - 1.0):+.2f} %" if true else ""
    return [f"{true:.4g}", error, "yes" if inside else "no"]


def _witness(found: Identification, points: Sequence[FrictionPoint]) -> Table:
    title = "A second witness: the drive moves by itself, 6077h is polled by SDO"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("axis", "speed", "friction by SDO", "of the fitted law", "unit"):
        table.add_column(name, justify="left" if name in ("axis", "unit") else "right", no_wrap=True)
    for point in points:
        axis = found.axes.get(point.axis)
        if axis is not None:
            fitted = f"{_friction(axis.law, point.velocity):.4g}"
            measured = f"{point.torque:.4g} +- {point.standard_error:.2g}"
            table.add_row(point.axis, f"{point.velocity:.4g} {axis.units.velocity}", measured, fitted, axis.units.torque)
    return table


def _friction(law: FrictionLaw, velocity: float) -> float:
    """Half the difference of both directions at a speed: what an offset leaves alone."""
    both = law.torque(np.array([velocity, -velocity]))
    return float(both[0] - both[1]) / 2.0
