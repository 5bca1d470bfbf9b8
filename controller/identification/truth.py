"""The plant's true friction, where an emulator was asked for it: for comparison only, after the fit."""

from __future__ import annotations

from collections.abc import Mapping

from controller.identification.friction_law import FrictionLaw


def true_law(truth: Mapping[str, float] | None) -> FrictionLaw | None:
    """The law of an axis' true parameters, named as those that are identified; None where the truth is not known."""
    if not truth or "coulomb" not in truth:
        return None
    coulomb = truth["coulomb"]
    return FrictionLaw(
        coulomb=coulomb,
        viscous=truth.get("viscous", 0.0),
        offset=truth.get("offset", 0.0),
        static_rise=truth.get("static_torque", coulomb) - coulomb,
        stribeck_velocity=truth.get("stribeck_velocity"),
        stribeck_exponent=truth.get("exponent", 2.0),
    )


def percent_error(value: float, true: float | None) -> float | None:
    """100 (value - true) / |true| [%]; None where the truth is unknown or zero."""
    return 100.0 * (value - true) / abs(true) if true else None
