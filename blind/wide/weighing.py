"""Weighs what each effect of a case costs along the motion that was recorded, and how large torque, gap and noise are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.case import Item, Level
from drivetwin.blind.wide.channel import passed
from drivetwin.blind.wide.effects import DRIVE
from drivetwin.blind.wide.motion import Plan
from drivetwin.blind.wide.simulator import Motion, Run
from drivetwin.blind.wide.window import Window, band_of, of_white_noise
from drivetwin.blind.wide.world import World, rms

Array = NDArray[np.float64]
Items = tuple[Cause, ...]


@dataclass(frozen=True)
class Recorded:
    """A validation recording without noise: motion of the motors, torque that it needs, gap (k, n) to the nominal model.

    `asked` (k, n) is what the drives asked for; `rate` [Hz] at which it is recorded; `strays` (n,): peak to
    peak of joint less motor [rad or m].
    """

    plan: Plan
    motion: Motion
    torque: Array
    asked: Array
    gap: Array
    rate: float
    window: Window
    strays: Array

    @classmethod
    def of(cls, world: World, items: Items, run: Run, plan: Plan) -> Recorded:
        """From what the simulator did."""
        motion = Motion(run.position, run.velocity, run.acceleration)
        torque = world.needs(items, motion, plan)
        measured = [passed(torque[:, k], of_axis(items, name)) for k, name in enumerate(world.names)]
        gap = np.column_stack(measured) - world.nominal_needs(world.read(motion, items))
        rate = next(rate for one, rate in zip(world.plans, world.rates, strict=True) if one.name == plan.name)
        band = band_of(list(np.column_stack(measured).T), motion.tick, rate)
        window = Window(band, motion.tick, world.moving(motion))
        return cls(plan, motion, torque, run.asked, gap, rate, window, np.ptp(run.joint - run.position, axis=0))

    def cost(self, world: World, item: Cause, items: Items) -> Array:
        """What an item costs its axis in motion (k,) [N·m or N]: the others of `items` are there, it is taken away."""
        k, others = world.names.index(item.axis), tuple(one for one in items if one is not item)
        return self.window.of(world.cost(item, self._base(item), others, self.motion, self.plan), k)

    def _base(self, item: Cause) -> Array:
        """Torque (k, n) on which an item makes its difference: a saturation and a slow current loop on the asked one."""
        return self.asked if item.effect in DRIVE else self.torque


def noise_of(world: World, recorded: Sequence[Recorded]) -> Array:
    """Rms of each axis's torque noise and quantum (n,) in the window [N·m or N]."""
    return quieted(recorded) * np.array([np.hypot(one.torque_noise, one.torque_quantum / 12.0**0.5) for one in world.channels])


def quieted(recorded: Sequence[Recorded]) -> float:
    """What the windows leave of white noise, of its rms."""
    return rms(np.array([of_white_noise(one.window.band, one.rate) for one in recorded]))


def torque_and_gap(world: World, recorded: Sequence[Recorded]) -> tuple[Array, Array]:
    """Of each axis in motion over all recordings, rms (n,) [N·m or N]."""
    axes = range(len(world.names))
    torque, gap = (
        np.array([rms(np.concatenate([one.window.of(getattr(one, what)[:, k], k) for one in recorded])) for k in axes])
        for what in ("torque", "gap")
    )
    return torque, gap


def item_of(world: World, item: Cause, items: Items, recorded: Sequence[Recorded], level: Level) -> Item:
    """An item of `items` with its size and share over all recordings."""
    return weighed(item, rms(np.concatenate([one.cost(world, item, items) for one in recorded])), level)


def weighed(item: Cause, cost: float, level: Level) -> Item:
    """An item by what it costs (rms in motion) [N·m or N]; what tells in the asked torque only is no part of the gap."""
    of = level.gap**2 + (cost**2 if item.effect in DRIVE else 0.0)
    share = min(1.0, cost**2 / of) if of > 0.0 else 0.0
    return Item(item.effect, item.axis, item.parameters, float(f"{cost / level.torque:.4g}"), float(f"{share:.4g}"))


def of_axis(items: Sequence[Cause], axis: str) -> tuple[Cause, ...]:
    """Those of an axis."""
    return tuple(item for item in items if item.axis == axis)
