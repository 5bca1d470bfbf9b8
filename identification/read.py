"""Reads identified.json back: the friction law of every axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.identified_file import DIRECTIONAL, EXPONENTS, LARGEST, STRIBECK, Axis, read_identified

SLOWEST = 1e-9
"""Stribeck velocity [rad/s or m/s]: below it friction rises where nothing moves."""


@dataclass(frozen=True)
class IdentifiedFriction:
    """Friction laws by axis, joint side, and the machine whose axes these are."""

    machine: str
    laws: dict[str, FrictionLaw]

    def law(self, axis: str) -> FrictionLaw:
        """The law of an axis. Raises UserError naming those that the file has."""
        if axis not in self.laws:
            raise UserError(f"nothing was identified of axis {axis!r}; the file has {', '.join(self.laws) or 'no axis'}")
        return self.laws[axis]


def read_friction(path: Path) -> IdentifiedFriction:
    """Friction laws of an identified/1 file: the direction-dependent one where that is real, the symmetric one elsewhere.

    Raises UserError naming the file and what is missing or wrong.
    """
    read = read_identified(path)
    exponent = read.settings.stribeck_exponent
    return IdentifiedFriction(read.machine, {name: _law(path, name, axis, exponent) for name, axis in read.axes.items()})


def _law(path: Path, name: str, axis: Axis, exponent: float) -> FrictionLaw:
    found = {key: parameter.value for key, parameter in axis.parameters.items()}
    if missing := [key for key in ("coulomb", "viscous") if key not in found]:
        raise UserError(
            f"{path}: axis {name} has no {' and no '.join(missing)} friction, so that its friction is not known at every "
            "speed: identify it from strokes at several speeds in both directions"
        )
    if lacking := [key for key in _parts(axis) if key not in found]:
        raise UserError(
            f"{path}: axis {name} has no {' and no '.join(lacking)}, which its other entries call for: "
            "take the file as `drivetwin identify` or `drivetwin fit` wrote it"
        )
    for key, low, high in (("stribeck_velocity", SLOWEST, LARGEST), ("stribeck_exponent", *EXPONENTS)):
        if not low <= found.get(key, low) <= high:
            raise UserError(
                f"{path}: axes.{name}.parameters.{key} is {found[key]:g}, expected {low:g} to {high:g}: take the file as "
                "`drivetwin identify` or `drivetwin fit` wrote it"
            )
    symmetric = FrictionLaw(
        coulomb=found["coulomb"],
        viscous=found["viscous"],
        offset=found.get("offset", 0.0),
        static_rise=found.get("static_torque", found["coulomb"]) - found["coulomb"],
        stribeck_velocity=found.get("stribeck_velocity"),
        stribeck_exponent=found.get("stribeck_exponent", exponent),
    )
    return _by_direction(symmetric, found) if axis.direction.real else symmetric


def _parts(axis: Axis) -> tuple[str, ...]:
    """What the law of an axis has besides Coulomb and viscous friction: one part of a term calls for the others."""
    stribeck = STRIBECK if any(key in axis.parameters for key in STRIBECK) else ()
    return (*(DIRECTIONAL if axis.direction.real else ()), *stribeck)


def _by_direction(law: FrictionLaw, found: dict[str, float]) -> FrictionLaw:
    """The law with the Coulomb and viscous friction of the direction-dependent fit."""
    coulomb = (found["coulomb_positive"], found["coulomb_negative"])
    viscous = (found["viscous_positive"], found["viscous_negative"])
    return replace(
        law,
        coulomb=sum(coulomb) / 2.0,
        viscous=sum(viscous) / 2.0,
        offset=(coulomb[0] - coulomb[1]) / 2.0,
        viscous_difference=(viscous[0] - viscous[1]) / 2.0,
    )
