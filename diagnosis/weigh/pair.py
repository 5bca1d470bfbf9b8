"""The same set of effects on all rows and on a part of them, on which starts are compared and moved."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from drivetwin.diagnosis.weigh.alignment import aligned
from drivetwin.diagnosis.weigh.bench import Bench
from drivetwin.diagnosis.weigh.colouring import coloured, read_anew
from drivetwin.diagnosis.weigh.proposal import Proposal
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import STEPS, settled_on
from drivetwin.emulator.effects import ModelEffect, PlacedEffect
from drivetwin.foundation.errors import UserError


@dataclass(frozen=True)
class Pair:
    """The same set on all rows, and on a part of them; the same state twice where the part is all of them."""

    whole: State
    part: State

    def without(self, one: PlacedEffect) -> Pair | None:
        """The set less one effect, the noise coloured as it was; None where the others make no mechanism without it.

        A late torque looks like what yields: without that it is sought anew.
        """
        rest = [each for each in self.whole.effects if each is not one]
        try:
            whole = aligned(self.whole.of(rest), axis=that_moves(one))
            return Pair(whole, self.part.of(rest).read(whole.late))
        except UserError:
            return None

    def settled(self, effects: Sequence[PlacedEffect], steps: int = STEPS, axis: str | None = None) -> State:
        """Another set, moved to where the evidence gains no more: on the part, and the rest of its way on all rows.

        `axis`: only effects of one axis move. Raises UserError where it makes no mechanism.
        """
        begun = self.whole.of(effects)
        if self.part.bench is not self.whole.bench:
            with suppress(UserError):
                ahead = self.whole.of(settled_on(self.part.of(effects), steps, axis).effects)
                begun = max(begun, ahead, key=lambda one: one.reached)
        return settled_on(begun, steps, axis)

    def as_noise_is(self, found: State, proposals: Sequence[Proposal]) -> Pair:
        """Another set, the noise coloured as what is left by it and by everything that could be asked beside it."""
        whole = coloured(read_anew(found, proposals), proposals)
        if self.part.bench is self.whole.bench:
            return Pair(whole, whole)
        part = state_of(self.part.bench, found.effects, self.part.bench.white, whole.late)
        return Pair(whole, coloured(part, proposals))


def that_moves(one: PlacedEffect) -> str | None:
    """The axis whose effects have to move where an effect comes or goes; None, which is all, where it is a body's."""
    return None if isinstance(one.effect, ModelEffect) else one.axis


def empty(bench: Bench, part: Bench) -> Pair:
    """No effect, the noise white at the level of the gap."""
    return Pair(*(state_of(one, (), one.white, {}) for one in (bench, part)))
