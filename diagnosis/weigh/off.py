"""Nominal parameters of the model that are off by more than chance, as effects of their own or bodies of another mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Family, same_kind
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import Effect, PlacedEffect
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.foundation.errors import UserError


def corrected(state: State, proposer: Proposer) -> tuple[State, list[Family]]:
    """Nominal parameters of axes that are off by more than chance and by enough to matter, as effects of their own."""
    families: list[Family] = []
    for number, one in enumerate(state.bench.nominals):
        effect = one.off_by(float(state.fit.coefficients[number]))
        if effect is None or one.axis is None or not _is_off(state, number):
            continue
        if type(effect) not in proposer.kinds.get(one.axis, ()):
            continue
        family = _instead(proposer, state.holding(number), one.axis, effect)
        if family is None:
            continue
        assert family.chosen is not None
        try:
            later = state.of(_with(state.effects, family.chosen, one.value))
        except UserError:
            continue
        families.append(family)
        state = settled_on(later)
    return state, families


def heavier(state: State) -> frozenset[int]:
    """Bodies, by number, whose mass is off by more than chance and by enough to matter."""
    return frozenset(
        one.body for number, one in enumerate(state.bench.nominals) if one.body is not None and _is_off(state, number)
    )


def _instead(proposer: Proposer, exact: State, axis: str, effect: Effect) -> Family | None:
    """A nominal parameter that is off, beside a set that has it as the model does, and all that could be so instead.

    Only its size is open: a body that is heavier has its place.
    """
    known = proposer.evaluated(exact, Begun(axis, effect, 0.0, 1), 1)
    if known is None:
        return None
    others = [one for one in proposer.proposals(Pair(exact, exact), [axis], ()) if not same_kind(one.effect, known.effect)]
    best = max(others, key=lambda one: one.score, default=known)
    return Family(best.effect if best.score > known.score + CLEARLY else known.effect, exact, [known, *others])


def _is_off(state: State, number: int) -> bool:
    held = state.held()
    if number in held:
        return False
    amount, deviation = state.fit.coefficients[number], np.sqrt(max(state.fit.covariance[number, number], 0.0))
    if abs(amount) < state.bench.settings.off * deviation:
        return False
    if not state.bench.nominals[number].told:
        return True
    free = state.energy(state.patched - {number})
    return max(state.left[axis] - free[axis] for axis in free) >= state.bench.settings.least_share


def _with(effects: Sequence[PlacedEffect], new: PlacedEffect, before: float) -> tuple[PlacedEffect, ...]:
    """With another Coulomb level beneath it, a Stribeck effect keeps its height above that."""
    raised = getattr(new.effect, "coulomb", before) - before
    kept = [
        replace(one, effect=replace(one.effect, static_torque=max(0.0, one.effect.static_torque + raised)))
        if isinstance(one.effect, Stribeck) and one.axis == new.axis
        else one
        for one in effects
    ]
    return (*kept, new)
