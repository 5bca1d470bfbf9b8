"""Everything that one withheld axis is, as the record that compiled code reads, and how the library's causes change it."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, inf, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import Cause
from drivetwin.blind.machines import DrawnAxis, DrawnMachine
from drivetwin.blind.plants.friction import MAXWELL_SLIP

AXIS = np.dtype(
    [
        (name, "f8")
        for name in (
            # motor: joint side; gear in motor turns a joint turn
            *("gear", "rotor", "brake", "constant_error", "cubic_loss", "offset"),
            *("ripple_amplitude", "ripple_order", "ripple_phase"),
            # a transmission that is a second body, where its stiffness is not 0
            *("mesh_stiffness", "mesh_damping", "hardening", "gap", "error_amplitude", "error_order", "error_phase"),
            # friction
            *("coulomb", "coulomb_asymmetry", "viscous", "viscous_asymmetry", "quadratic", "cubic"),
            *("static_torque", "stribeck_velocity", "exponent", "load_coefficient"),
            *("position_amplitude", "position_period", "position_phase", "cold", "warming_time"),
            *("stiffness", "damping", "smooth_velocity"),
            # what pulls at the joint
            *("sine", "cosine", "constant", "spring_stiffness", "spring_rest"),
            # encoder: eccentricity on the motor's side, delay in seconds
            *("eccentricity", "eccentricity_phase", "delay"),
            # power stage: joint side; Hz
            *("current_limit", "bandwidth"),
        )
    ]
)
"""One axis; joint side, SI."""

STIFF = 1e-6
"""Presliding of a joint that is not meant to have any, as a share of its travel."""

STIFF_MESH_HZ = 180.0
"""A transmission that is meant to be rigid, where something in it needs two bodies, swings at this."""


def withheld_axes(
    machine: DrawnMachine, causes: tuple[Cause, ...], formulation: int, links: NDArray[np.float64]
) -> NDArray[np.void]:
    """Records (n,) of a machine's axes with the library's causes in them; `links` (n,) is the inertia behind each gear.

    Causes that change rigid bodies (payload, coupling) and those outside the library are not here.
    """
    axes = np.zeros(len(machine.axes), dtype=AXIS)
    for record, (name, axis), inertia in zip(axes, machine.axes.items(), links, strict=True):
        _nominal(record, axis)
        for cause in causes:
            if cause.axis == name and cause.effect == "gravity":
                (_weight if axis.slide else _gravity)(record, cause.parameters)
            elif cause.axis == name and cause.effect in CHANGES:
                CHANGES[cause.effect](record, cause.parameters)
        _settle(record, axis, float(inertia), formulation)
    return axes


def _nominal(record: np.void, axis: DrawnAxis) -> None:
    record["gear"] = axis.gear_ratio
    record["rotor"] = axis.rotor_inertia * axis.gear_ratio**2
    record["brake"] = 2.0 * axis.weight
    record["coulomb"] = axis.coulomb
    record["viscous"] = axis.viscous
    record["exponent"] = 2.0
    record["position_period"] = record["warming_time"] = 1.0
    record["smooth_velocity"] = 2e-3 * axis.max_speed
    record["current_limit"] = inf


def _settle(record: np.void, axis: DrawnAxis, links: float, formulation: int) -> None:
    """Stiffness and damping of what nobody has drawn: friction that hardly gives way, teeth that hardly yield."""
    if record["stiffness"] == 0.0:
        record["stiffness"] = record["coulomb"] / (STIFF * axis.room)
    elif formulation == MAXWELL_SLIP:
        record["stiffness"] *= 1.15  # seven springs reach sliding later than four of the same stiffness
    if record["damping"] == 0.0:
        record["damping"] = 1.2 * sqrt(record["stiffness"] * axis.inertia)
    if record["mesh_stiffness"] == 0.0 and record["error_amplitude"] != 0.0:
        between = record["rotor"] * links / (record["rotor"] + links)
        record["mesh_stiffness"] = between * (2.0 * pi * STIFF_MESH_HZ) ** 2
        record["mesh_damping"] = 0.6 * sqrt(record["mesh_stiffness"] * between)


Values = dict[str, float]
Change = Callable[[np.void, Values], None]


def _same(**names: str) -> Change:
    """Parameters that go into the record as they are: its field = their name."""

    def change(record: np.void, values: Values) -> None:
        for field, name in names.items():
            if name in values:
                record[field] = values[name]

    return change


def _inertia(record: np.void, values: Values) -> None:
    record["rotor"] += values["difference"]


def _gravity(record: np.void, values: Values) -> None:
    """On a hinge; a slide's is constant."""
    record["sine"] = values["moment"] * cos(values["angle"])
    record["cosine"] = -values["moment"] * sin(values["angle"])


def _weight(record: np.void, values: Values) -> None:
    record["constant"] = values["moment"]


def _magnetic_saturation(record: np.void, values: Values) -> None:
    record["cubic_loss"] = values["knee"] ** -2


def _encoder_eccentricity(record: np.void, values: Values) -> None:
    record["eccentricity"] = values["amplitude"] * record["gear"]
    record["eccentricity_phase"] = values["phase"]


def _elasticity(record: np.void, values: Values) -> None:
    """Harder by a tenth where it is twisted as far as eight times the Coulomb friction twists it."""
    _mesh(record, values)
    record["hardening"] = 0.1 * (values["stiffness"] / (8.0 * record["coulomb"])) ** 2


_mesh = _same(mesh_stiffness="stiffness", mesh_damping="damping", gap="gap")

CHANGES: dict[str, Change] = {
    "coulomb": _same(coulomb="coulomb"),
    "viscous": _same(viscous="viscous"),
    "coulomb_asymmetry": _same(coulomb_asymmetry="asymmetry"),
    "viscous_asymmetry": _same(viscous_asymmetry="asymmetry"),
    "stribeck": _same(static_torque="static_torque", stribeck_velocity="stribeck_velocity", exponent="exponent"),
    "viscous_nonlinear": _same(quadratic="quadratic", cubic="cubic"),
    "presliding": _same(stiffness="stiffness", damping="damping"),
    "load_friction": _same(load_coefficient="coefficient"),
    "position_friction": _same(position_amplitude="amplitude", position_period="period", position_phase="phase"),
    "temperature_drift": _same(cold="cold", warming_time="time_constant"),
    "inertia": _inertia,
    "spring": _same(spring_stiffness="stiffness", spring_rest="rest"),
    "backlash": _mesh,
    "elasticity": _elasticity,
    "transmission_error": _same(error_amplitude="amplitude", error_order="order", error_phase="phase"),
    "torque_constant": _same(constant_error="error"),
    "magnetic_saturation": _magnetic_saturation,
    "torque_saturation": _same(current_limit="limit"),
    "torque_ripple": _same(ripple_amplitude="amplitude", ripple_order="order", ripple_phase="phase"),
    "torque_offset": _same(offset="offset"),
    "current_bandwidth": _same(bandwidth="bandwidth"),
    "encoder_eccentricity": _encoder_eccentricity,
    "delay": _same(delay="delay"),
}
"""How a cause of the library changes the record of its axis; `gravity` differs between hinge and slide."""

FORMULATED = frozenset({"gravity", *CHANGES})
"""Effects of which an axis here has its own formula."""
