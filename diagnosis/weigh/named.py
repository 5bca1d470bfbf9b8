"""From the set that a search found to the one that is named: less what is doubtful, needless or not worth what it costs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import log

from drivetwin.diagnosis.propose.placing import alike
from drivetwin.diagnosis.weigh.alignment import aligned
from drivetwin.diagnosis.weigh.averaging import Answer, believed
from drivetwin.diagnosis.weigh.needed import needed
from drivetwin.diagnosis.weigh.off import corrected, heavier
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Family
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.refit import least_squares, left_on
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on, tried_set
from drivetwin.emulator.effects import PlacedEffect

Weigh = Callable[[Family], Answer]
Names = tuple[tuple[str, str], ...]


def named(state: State, answers: Sequence[Answer], proposer: Proposer, weigh: Weigh) -> tuple[State, list[Answer]]:
    """The set that is named, and the answers with those about nominal parameters that are off.

    What was worth its cost beside an effect that has gone may not be so without it: an offset beside a torque constant, say.
    Such an effect goes too, and nominal parameters take its place, where no axis then keeps more of its gap and no more effects
    are named: what moved several parameters is one cause.
    """
    state, told = _once(state, answers, proposer, weigh)
    first, seen = _left(state), {_names(state)}
    kept: list[PlacedEffect] = []
    while (gone := _too_dear(state, kept, proposer)) is not None:
        effect, lean = gone
        ahead, others = _once(lean, _about(lean, answers), proposer, weigh)
        if _names(ahead) in seen or len(ahead.effects) > len(state.effects) or _leaves_more(ahead, first):
            kept.append(effect)
            continue
        state, told = ahead, others
        seen.add(_names(state))
    return state, told


def _once(state: State, answers: Sequence[Answer], proposer: Proposer, weigh: Weigh) -> tuple[State, list[Answer]]:
    """The set less what is doubtful, with nominal parameters that are off as effects, and less what a patch does not need."""
    state, off = corrected(believed(state, answers), proposer)
    told = [*answers, *map(weigh, off)]
    return needed(aligned(believed(state, told))), told


def _about(state: State, answers: Sequence[Answer]) -> list[Answer]:
    """Answers about what is still in a set: others were given beside what has gone."""
    return [one for one in answers if one.chosen is None or any(alike(one.chosen, each) for each in state.effects)]


def _too_dear(state: State, kept: Sequence[PlacedEffect], proposer: Proposer) -> tuple[PlacedEffect, State] | None:
    """The effect that says least for what it costs, with nominal parameters free in its place, and the set without it; None
    where each is worth its cost, or is among those that are `kept`.
    """
    settled = settled_on(state)
    found = []
    for one in settled.effects:
        if _is_nominal(one, settled) or any(alike(one, each) for each in kept):
            continue
        cost = log(proposer.tried(one.axis)) - CLEARLY
        less = tried_set(settled, [each for each in settled.effects if each is not one])
        if less is None or less.fit.evidence + cost <= settled.reached:
            continue
        less = settled_on(less)
        if less.reached + cost > settled.reached:
            found.append((less.reached + cost, one, less))
    return max(found, key=lambda each: each[0])[1:] if found else None


def _is_nominal(one: PlacedEffect, state: State) -> bool:
    """Whether an effect is a parameter of the model that is off: it costs what its prior says, not a name."""
    return any(each.told and (each.effect, each.axis) == (one.effect.name, one.axis) for each in state.bench.nominals)


def _names(state: State) -> Names:
    return tuple(sorted((one.effect.name, one.axis) for one in state.effects))


def _left(state: State) -> dict[str, float]:
    """Share of each axis's gap that a patch of a set leaves."""
    bodies = heavier(state)
    return left_on(least_squares(state, bodies), bodies)


def _leaves_more(state: State, first: Mapping[str, float]) -> bool:
    least = state.bench.settings.least_share
    return any(left > first[axis] + least for axis, left in _left(state).items())
