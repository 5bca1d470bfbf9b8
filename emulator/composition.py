"""A machine's effects combined with others, or its model replaced; what is overridden is reported, never dropped silently."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco

from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.motion.model_file import named_model, state_motors


@dataclass(frozen=True)
class Composition:
    """The effects that act, and a line for each of the machine's own that gave way."""

    effects: tuple[PlacedEffect, ...]
    gave_way: tuple[str, ...]


def composed(
    own: Sequence[PlacedEffect],
    added: Sequence[PlacedEffect] = (),
    model: Path | None = None,
    joints: Mapping[str, str] | None = None,
) -> Composition:
    """The machine's `own` effects, and those `added` to it.

    Two values of one quantity cannot both act. An added effect takes the place of the machine's own of its kind on its axis,
    unless an axis may have several. Friction that `model` gives the joint of an axis (`joints`, by axis) takes the place of the
    machine's own Coulomb or viscous friction, and an added one that of the model's.
    """
    kept, gave_way = [], []
    stated = {} if model is None else _stated(model, joints or {})
    replacing = {(placed.axis, placed.effect.name) for placed in added if not placed.effect.several}
    for placed in own:
        key = (placed.axis, placed.effect.name)
        if key in replacing:
            name = placed.effect.name
            gave_way.append(f"{placed.axis}: the added {name} takes the place of the machine's own ({_told(placed)})")
        elif key in stated:
            gave_way.append(f"{placed.axis}: {stated[key]} of {model} takes the place of the machine's own {_told(placed)}")
        else:
            kept.append(placed)
    for placed in added:
        if words := stated.get((placed.axis, placed.effect.name)):
            gave_way.append(f"{placed.axis}: the added {_told(placed)} takes the place of {words} of {model}")
    return Composition((*kept, *added), tuple(gave_way))


def _stated(path: Path, joints: Mapping[str, str]) -> dict[tuple[str, str], str]:
    """Friction that the model has, in words, by axis and the effect that it is."""
    spec, _ = named_model(path)
    known = {joint.name for joint in spec.joints}
    state_motors(spec, known)
    return {
        (axis, kind): words
        for axis, joint in joints.items()
        if joint in known
        for kind, words in _friction(spec.joint(joint))
    }


def _friction(joint: mujoco.MjsJoint) -> list[tuple[str, str]]:
    found = []
    if joint.frictionloss > 0.0:
        found.append((Coulomb.name, f"frictionloss {joint.frictionloss:g}"))
    if joint.damping[0] > 0.0:
        found.append((Viscous.name, f"damping {joint.damping[0]:g}"))
    return found


def _told(placed: PlacedEffect) -> str:
    values = (f"{one.name} {getattr(placed.effect, one.name):g}" for one in placed.effect.parameters)
    return ", ".join(values)
