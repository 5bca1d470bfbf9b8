"""What `drivetwin identify` says in the terminal: the errors, the parameters, and the cross-check by SDO."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from drivetwin.controller.procedure import Captured
from drivetwin.controller.sdo_check import FrictionPoint
from drivetwin.foundation.quantities import quantity, with_interval
from drivetwin.identification import Identification, Truth
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.truth import true_value
from drivetwin.identification.wording import headline, row_of


def print_summary(console: Console, found: Identification, truth: Truth | None, captured: Captured, out: Path) -> None:
    """Tables, figures of the capture, and where the files are."""
    sentence = headline(found, truth or {})
    if sentence:
        console.print(sentence, highlight=False)
    console.print(_parameters(found, truth or {}))
    for name, axis in found.axes.items():
        if axis.direction is not None and axis.direction.real:
            forwards, backwards = (axis.parameters[f"viscous_{way}"] for way in ("positive", "negative"))
            console.print(
                f"{name}: friction depends on the direction: viscous {quantity(forwards.value, forwards.unit)} forwards, "
                f"{quantity(backwards.value, backwards.unit)} backwards; the symmetric law above is a compromise",
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
    for name in ("identified", *(("true", "error") if truth else ()), "90 % interval", "unit"):
        table.add_column(name, no_wrap=True, justify="left" if name == "unit" else "right")
    if truth:
        table.add_column("in interval", no_wrap=True)
    for axis_name, axis in found.axes.items():
        shown = {name: axis.parameters[name] for name in SHOWN if name in axis.parameters}
        for at, (name, parameter) in enumerate(shown.items()):
            row = row_of(name, parameter, true_value(truth[axis_name], name) if truth else None)
            against = (row.true, row.error) if truth else ()
            cells = (row.label, row.value, *against, f"{row.low} .. {row.high}", row.unit)
            table.add_row(axis_name if at == 0 else "", *cells, *([row.interval_holds] if truth else []))
        table.add_section()
    return table


def _witness(found: Identification, points: Sequence[FrictionPoint]) -> Table:
    title = "Cross-check: the drive moves by itself, 6077h is polled by SDO"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("axis", "speed", "friction by SDO", "90 % interval", "fitted law", "difference", "unit"):
        table.add_column(name, justify="left" if name in ("axis", "unit") else "right", no_wrap=True)
    for point in points:
        axis = found.axes.get(point.axis)
        if axis is not None:
            fitted = _friction(axis.law, point.velocity)
            (value, low, high, law), unit = with_interval(point.torque, point.ci90, axis.units.torque, fitted)
            difference = f"{100.0 * (fitted / point.torque - 1.0):+.1f} %" if point.torque else "-"
            speed = quantity(point.velocity, axis.units.velocity)
            table.add_row(point.axis, speed, value, f"{low} .. {high}", law, difference, unit)
    return table


def _friction(law: FrictionLaw, velocity: float) -> float:
    """Half the difference of both directions at a speed: what an offset leaves alone."""
    both = law.torque(np.array([velocity, -velocity]))
    return float(both[0] - both[1]) / 2.0
