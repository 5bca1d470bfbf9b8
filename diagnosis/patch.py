"""What a selection adds to the simulation: its effects, and the model's own parameters corrected."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

from diagnosis.comparison import Comparison
from diagnosis.deviations import Deviation, as_effects
from diagnosis.placing import in_order
from diagnosis.prediction import Patch
from diagnosis.selection import Selection
from drivetwin.errors import UserError
from emulator.effects.stribeck import Stribeck

logger = logging.getLogger(__name__)


def patch_of(comparison: Comparison, selection: Selection) -> Patch:
    """The selected effects, and the parameters that were found off; a Stribeck level stands on the corrected Coulomb level."""
    corrections = patch_of_deviations(comparison, selection.deviations)
    coulomb = {one.axis: one.members[0].amount for one in selection.deviations if one.effect == "coulomb"}
    effects = [
        replace(one, effect=replace(one.effect, static_torque=one.effect.static_torque + coulomb.get(one.axis, 0.0)))
        if isinstance(one.effect, Stribeck)
        else one
        for one in selection.effects
    ]
    return Patch(in_order([*corrections.effects, *effects]), corrections.heavier)


def patch_of_deviations(comparison: Comparison, found: Sequence[Deviation]) -> Patch:
    """Parameters that were found off, as what corrects them."""
    members = [member for one in found for member in one.members]
    heavier = {one.nominal.body: one.amount for one in members if one.nominal.body is not None}
    return Patch(as_effects(comparison, found), heavier)


def together(one: Patch, other: Patch) -> Patch:
    """Both."""
    return Patch(in_order([*one.effects, *other.effects]), {**(one.heavier or {}), **(other.heavier or {})})


def bearable(comparison: Comparison, selection: Selection) -> list[Deviation]:
    """Deviations that make a mechanism together with the effects: friction lowered beside them could push at some speed."""
    kept: list[Deviation] = []
    for one in selection.deviations:
        try:
            comparison.simulation.dynamics(in_order([*as_effects(comparison, [*kept, one]), *selection.effects]))
        except UserError as error:
            logger.warning("%s on %s is left as the model has it: %s", one.effect, one.axis, error)
            continue
        kept.append(one)
    return kept
