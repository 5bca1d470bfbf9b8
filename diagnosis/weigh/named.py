"""From the set that a search found to the one that is named: less what is doubtful, needless or not worth what it costs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import log

from drivetwin.diagnosis.propose.placing import Name, alike, name_of
from drivetwin.diagnosis.weigh.alignment import aligned
from drivetwin.diagnosis.weigh.averaging import Answer, believed
from drivetwin.diagnosis.weigh.needed import needed
from drivetwin.diagnosis.weigh.off import EASED, Weigh, corrected, heavier, instead_of_masses, is_off
from drivetwin.diagnosis.weigh.proposal import CLEARLY
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.refit import least_squares, left_on
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on, tried_set
from drivetwin.emulator.effects import PlacedEffect


def named(state: State, answers: Sequence[Answer], proposer: Proposer, weigh: Weigh) -> tuple[State, list[Answer]]:
    """The set that is named, and the answers with those about nominal parameters that are off.

    What was worth its cost beside an effect that has gone may not be so without it: an offset beside a torque constant, say.
    Such an effect goes too, and a nominal parameter takes its place, where no axis then keeps more of its gap. Where instead
    another effect has to be named for it, it stays: that is no nominal parameter either.
    """
    state, told = _once(state, answers, proposer, weigh, ())
    first, kept, given_up = _left(state), list[PlacedEffect](), set[Name]()
    while (gone := _too_dear(state, kept, proposer)) is not None:
        effect, lean = gone
        without = given_up | {name_of(effect)}
        ahead, others = _once(lean, _about(lean, answers), proposer, weigh, without)
        if without & set(map(name_of, ahead.effects)) or _names_another(ahead, lean) or _leaves_more(ahead, first):
            kept.append(effect)
            continue
        state, told, given_up = ahead, others, without
    return state, told


def _once(
    state: State, answers: Sequence[Answer], proposer: Proposer, weigh: Weigh, given_up: Collection[Name]
) -> tuple[State, list[Answer]]:
    """The set less what is doubtful, with nominal parameters that are off as effects, and less what a patch does not need.

    Not with nominal parameters that a straight line promised more of than a patch with them holds.
    """
    less = believed(state, answers)
    state, off = corrected(less, proposer, weigh, given_up)
    if off and _leaves_more(state, _left(less)):
        state, off = less, []
    state, of_masses = instead_of_masses(state, proposer, given_up)
    told = [*answers, *off, *of_masses]
    return needed(aligned(believed(state, told))), told


def _about(state: State, answers: Sequence[Answer]) -> list[Answer]:
    """Answers about what is still in a set: others were given beside what has gone."""
    return [one for one in answers if one.chosen is None or any(alike(one.chosen, each) for each in state.effects)]


def _too_dear(state: State, kept: Sequence[PlacedEffect], proposer: Proposer) -> tuple[PlacedEffect, State] | None:
    """The effect that says least for what it costs, with nominal parameters free in its place, and the set without it; None
    where each is worth its cost, or is among those that are `kept`.

    It says nothing where these leave hardly more of the gap: what is told then is less than what the comparison errs by,
    however many nats that is. Where several of them move for it, it is their one cause.
    """
    settled = settled_on(state)
    left, found = _left_at_best(settled), []
    for one in settled.effects:
        less = None if _is_nominal(one, settled) else tried_set(settled, [each for each in settled.effects if each is not one])
        if less is None or any(alike(one, each) for each in kept):
            continue
        cost = log(proposer.tried(one.axis)) - CLEARLY
        as_close = _left_at_best(less) < left + settled.bench.least(one)
        if not as_close and less.promised + cost <= settled.reached:
            continue
        less = settled_on(less)
        if (as_close or less.reached + cost > settled.reached) and not _moves_several(settled, less):
            found.append((less.reached + cost, one, less))
    return max(found, key=lambda each: each[0])[1:] if found else None


def _moves_several(before: State, after: State) -> bool:
    """Whether more is asked of nominal parameters, the one of which most is left aside; or more than one would be named."""
    numbers = range(len(after.bench.nominals))
    more = sorted(_asked(after, number) - _asked(before, number) for number in numbers)
    return sum(more[:-1]) > EASED or sum(is_off(after, number) and not is_off(before, number) for number in numbers) > 1


def _asked(state: State, number: int) -> float:
    """What a set asks of one nominal parameter [nats]; nothing where an effect stands for it."""
    return 0.0 if number in state.held() else state.system.strain_of(state.fit, number)


def _left_at_best(state: State) -> float:
    """Share of the gaps that a set leaves with nominal parameters and effects where least is left, the sum of all axes."""
    return sum(state.energy(state.held()).values())


def _is_nominal(one: PlacedEffect, state: State) -> bool:
    """Whether an effect is a parameter of the model that is off: it costs what its prior says, not a name."""
    return any((each.effect, each.axis) == (one.effect.name, one.axis) for each in state.bench.nominals)


def _names_another(state: State, before: State) -> bool:
    """Whether a set has an effect that was not there before and is no nominal parameter."""
    there = set(map(name_of, before.effects))
    return any(name_of(one) not in there and not _is_nominal(one, state) for one in state.effects)


def _left(state: State) -> dict[str, float]:
    """Share of each axis's gap that a patch of a set leaves."""
    bodies = heavier(state)
    return left_on(least_squares(state, bodies), bodies)


def _leaves_more(state: State, first: Mapping[str, float]) -> bool:
    return any(left > state.bench.tolerated(axis, first[axis]) for axis, left in _left(state).items())
