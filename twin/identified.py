"""identified.json as effects, axis by axis: added to a model, they make it the identified one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from drivetwin.emulator.effects import PlacedEffect, library
from drivetwin.foundation.errors import UserError
from drivetwin.identification.identified_file import DIRECTIONAL, STRIBECK, Axis, Identified, Value
from drivetwin.motion.coupled_motion import friction_of_followers
from drivetwin.motion.inverse_dynamics import Model


def identified_effects(path: Path, found: Identified, model: Model) -> tuple[PlacedEffect, ...]:
    """What was identified, as effects on `model`: inertia as the difference from the model's, friction as it is.

    The direction-dependent friction where its test says that it is real, else the symmetric one. A Coulomb friction that
    differs by direction is `coulomb_asymmetry`; an offset whose 90 % interval leaves out 0 a torque that the drive reports and
    the shaft does not give (`torque_offset`): while an axis slides these are one and the same. Friction of joints that follow
    the axis stays theirs, and is taken off. Raises UserError for values that are no effect.
    """
    if not found.axes:
        raise UserError(f"{path}: axes: there is none, so nothing was identified")
    joints = list(found.joints.values())
    dofs = [int(model.given.joint(joint).dofadr[0]) for joint in joints]
    followers = friction_of_followers(model.given, model.ratios(joints), dofs)
    return tuple(
        effect
        for (name, axis), theirs in zip(found.axes.items(), followers, strict=True)
        for effect in _of_axis(f"{path}: axes.{name}", name, axis, theirs, model, found.settings.stribeck_exponent)
    )


def _of_axis(
    where: str, name: str, axis: Axis, followers: tuple[float, float], model: Model, exponent: float
) -> list[PlacedEffect]:
    given = axis.parameters
    values: dict[str, dict[str, Value]] = {}
    for key in ("coulomb", "viscous"):
        if key in given and _is_negative(given[key]):
            raise UserError(f"{where}: {key} is {given[key].value:g} beyond doubt: friction below 0 would push; record again")
    if "inertia" in given:
        values["inertia"] = {"difference": _less(given["inertia"], model.inertia(axis.joint))}
    values |= _friction(axis, followers)
    if all(key in given for key in STRIBECK):
        rise = given["static_torque"].value - given["coulomb"].value if "coulomb" in given else 0.0
        level = values["coulomb"]["coulomb"].value if "coulomb" in values else 0.0
        values["stribeck"] = {
            "static_torque": Value(value=level + rise, unit=given["static_torque"].unit),
            "stribeck_velocity": given["stribeck_velocity"],
            "exponent": given.get("stribeck_exponent", Value(value=exponent, unit="1")),
        }
    return [_placed(where, name, effect, parameters) for effect, parameters in values.items()]


def _friction(axis: Axis, followers: tuple[float, float]) -> dict[str, dict[str, Value]]:
    """Coulomb and viscous friction of the joint itself, and how it differs by direction or is offset."""
    given = axis.parameters
    if axis.direction.real and all(key in given for key in DIRECTIONAL):
        coulomb, coulomb_half = _by_direction(given["coulomb_positive"], given["coulomb_negative"])
        viscous, viscous_half = _by_direction(given["viscous_positive"], given["viscous_negative"])
        return {
            "coulomb": {"coulomb": _less(coulomb, followers[0], least=0.0)},
            "viscous": {"viscous": _less(viscous, followers[1], least=0.0)},
            "coulomb_asymmetry": {"asymmetry": coulomb_half},
            "viscous_asymmetry": {"asymmetry": viscous_half},
        }
    found = {}
    for key, theirs in (("coulomb", followers[0]), ("viscous", followers[1])):
        if key in given:
            found[key] = {key: _less(given[key], theirs, least=0.0)}
    if "offset" in given and _is_real(given["offset"]):
        found["torque_offset"] = {"offset": Value(value=-given["offset"].value, unit=given["offset"].unit)}
    return found


def _by_direction(positive: Value, negative: Value) -> tuple[Value, Value]:
    """Mean and half the difference."""
    mean, half = (positive.value + negative.value) / 2.0, (positive.value - negative.value) / 2.0
    return Value(value=mean, unit=positive.unit), Value(value=half, unit=positive.unit)


def _less(value: Value, other: float, least: float = -np.inf) -> Value:
    return Value(value=max(least, value.value - other), unit=value.unit)


def _is_negative(friction: Value) -> bool:
    """A value a little below 0 is what noise makes of none."""
    return friction.ci90 is not None and friction.ci90[1] < 0.0


def _is_real(offset: Value) -> bool:
    return offset.ci90 is None or not offset.ci90[0] <= 0.0 <= offset.ci90[1]


def _placed(where: str, axis: str, effect: str, parameters: Mapping[str, Value]) -> PlacedEffect:
    kind = library()[effect]
    for one in kind.parameters:
        value = parameters[one.name].value
        if not one.low <= value <= one.high:
            raise UserError(
                f"{where}: {one.name} of {effect} would be {value:g}, expected {one.low:g} to {one.high:g}: take the file as "
                "`drivetwin identify` or `drivetwin fit` wrote it"
            )
    made = kind(**{one.name: parameters[one.name].value for one in kind.parameters})
    return PlacedEffect(axis, made, {name: value.unit for name, value in parameters.items()})
