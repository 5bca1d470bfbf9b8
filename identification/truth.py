"""The plant's true friction, if an emulator can be asked for it: for comparison only, after the fit."""

from __future__ import annotations

from collections.abc import Mapping

from drivetwin.identification.friction_law import FrictionLaw


def true_law(truth: Mapping[str, float] | None, offset: float) -> FrictionLaw | None:
    """The law of an axis' true parameters, named as those that are identified; None where the truth is not known.

    `offset` is the fitted one: what the model lacks of gravity is no friction, and would part the curves by itself.
    """
    if not truth or "coulomb" not in truth:
        return None
    coulomb = truth["coulomb"]
    return FrictionLaw(
        coulomb=coulomb,
        viscous=truth.get("viscous", 0.0),
        offset=truth.get("offset", offset),
        viscous_difference=(truth.get("viscous_positive", 0.0) - truth.get("viscous_negative", 0.0)) / 2.0,
        static_rise=truth.get("static_torque", coulomb) - coulomb,
        stribeck_velocity=truth.get("stribeck_velocity"),
        stribeck_exponent=truth.get("exponent", 2.0),
    )


_OTHERWISE_NAMED = {"stribeck_exponent": "exponent"}
"""Parameters that a plant's effects name otherwise."""


def true_value(truth: Mapping[str, float], name: str) -> float | None:
    """The true value of parameter `name`; None where it is not known.

    The direction-dependent Coulomb torques hold the offset, so that they can be compared only where the truth names it.
    """
    sign = {"coulomb_positive": 1.0, "coulomb_negative": -1.0}.get(name)
    if sign is None:
        return truth.get(_OTHERWISE_NAMED.get(name, name))
    if "offset" not in truth or name not in truth:
        return None
    return truth[name] + sign * truth["offset"]


def percent_error(value: float, true: float | None) -> float | None:
    """100 (value - true) / |true| [%]; None where the truth is unknown or zero."""
    return 100.0 * (value - true) / abs(true) if true else None
