"""Gives each effect of a case its size along a motion: parameters at which it costs the torque that it should."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.effects import LIBRARY, NUISANCES, Ground, Sizable, suits
from drivetwin.blind.wide.foreign import FOREIGN
from drivetwin.blind.wide.friction import yielding_way
from drivetwin.blind.wide.machines import Draw
from drivetwin.blind.wide.motion import Plan
from drivetwin.blind.wide.simulator import Motion
from drivetwin.blind.wide.window import Window
from drivetwin.blind.wide.world import Items, World, motion_of, rms, travel

Array = NDArray[np.float64]

SIZES = (0.01, 0.3)
"""Torque of a cause over the axis's, both rms in motion; any octave as likely."""

BESIDE = (0.02, 0.1)
"""Energy of a nuisance over that of the largest cause."""

HIDDEN = 0.2
"""Energy of presliding over that of a cause, above which it hides the cause."""

_STEPS = 5
_CLOSE, _REACHED = 0.15, 0.8
_STRIDE = 4
_OPEN = 400.0
"""Band [Hz] in which plans are compared."""


@dataclass(frozen=True)
class Stretch:
    """A motion (k, n) by a plan, and what the nominal model needs for it [N·m or N]; `window`: what counts of a torque."""

    plan: Plan
    motion: Motion
    window: Window
    nominal: Array

    @classmethod
    def of(cls, world: World, plan: Plan, motion: Motion, band: float) -> Stretch:
        """Of a world, compared in a band [Hz]."""
        return cls(plan, motion, Window(band, motion.tick, world.moving(motion)), world.nominal_needs(motion))


@dataclass(frozen=True)
class Along:
    """The motions along which effects get their sizes, and each axis's torque (n,) there, rms in motion [N·m or N]."""

    stretches: tuple[Stretch, ...]

    @classmethod
    def planned(cls, world: World, plans: Sequence[Plan]) -> Along:
        """As they are planned; in which band they will be compared is not known yet."""
        return cls(tuple(Stretch.of(world, plan, motion_of(plan.position, _STRIDE), _OPEN) for plan in plans))

    @classmethod
    def recorded(cls, world: World, moved: Sequence[tuple[Plan, Motion, float]]) -> Along:
        """As the motors moved, given at every servo period, compared in a band [Hz]."""
        return cls(tuple(Stretch.of(world, plan, _thinned(motion), band) for plan, motion, band in moved))

    @cached_property
    def torque(self) -> Array:
        """Of the nominal model."""
        return self._rms([one.nominal for one in self.stretches])

    def presliding(self, world: World) -> Array:
        """Rms in motion (n,) of what presliding costs each axis [N·m or N]."""
        return self._rms([world.needs((), one.motion, one.plan) - one.nominal for one in self.stretches])

    def _rms(self, values: Sequence[Array]) -> Array:
        return np.array([rms(self._moving(values, k)) for k in range(values[0].shape[1])])

    def _moving(self, values: Sequence[Array], axis: int) -> Array:
        """Of an axis (m,), from values (k, n) of each stretch."""
        return np.concatenate([one.window.of(each[:, axis], axis) for each, one in zip(values, self.stretches, strict=True)])

    def ground(self, draw: Draw, world: World, axis: int) -> Ground:
        """What an effect of an axis is drawn for."""
        machine, limit = world.machine, world.machine.limits[axis]
        return Ground(
            draw=draw,
            machine=machine,
            axis=axis,
            torque=float(self.torque[axis]),
            top_torque=float(np.abs(self._moving([one.nominal for one in self.stretches], axis)).max()),
            links=world.links[axis],
            travel=travel(machine, axis),
            middle=(limit.low + limit.high) / 2.0,
            speed=float(np.quantile(np.abs(self._moving([one.motion.velocity for one in self.stretches], axis)), 0.98)),
            parent=machine.links[axis].parent,
        )

    def sized(self, world: World, effect: str, sizable: Sizable, axis: int, size: float, before: Items) -> tuple[Cause, float]:
        """An effect beside those `before` it, and its size: `size`, or as near as its bounds allow (secant on logarithms).

        A size is what the effect costs over the axis's torque, both rms in motion.
        """
        bases = [world.needs(before, one.motion, one.plan) for one in self.stretches]
        factor, tried = 0.1, list[tuple[float, float, Cause]]()
        for _ in range(_STEPS):
            cause = Cause(effect, world.names[axis], {key: float(f"{value:.6g}") for key, value in sizable(factor).items()})
            costs = [
                one.window.of(world.cost(cause, base, (*before, cause), one.motion, one.plan), axis)
                for base, one in zip(bases, self.stretches, strict=True)
            ]
            cost = rms(np.concatenate(costs))
            tried.append((float(np.log(max(cost / (size * self.torque[axis]), 1e-9))), factor, cause))
            if abs(tried[-1][0]) < _CLOSE:
                break
            factor *= _step(tried)
        error, _, cause = min(tried, key=lambda one: abs(one[0]))
        return cause, size * float(np.exp(error))


def _thinned(motion: Motion) -> Motion:
    position, velocity, acceleration = (each[::_STRIDE] for each in (motion.position, motion.velocity, motion.acceleration))
    return Motion(position, velocity, acceleration, _STRIDE * motion.tick)


def _step(tried: Sequence[tuple[float, float, Cause]]) -> float:
    """By what to multiply the last factor, from the logarithmic errors so far."""
    slope = 1.0
    if len(tried) > 1:
        (error, at, _), (last, before_at, _) = tried[-1], tried[-2]
        slope = float(np.clip((error - last) / np.log(at / before_at), 0.4, 3.0))
    return float(np.exp(np.clip(-tried[-1][0] / slope, -4.0, 4.0)))


def sized_causes(draw: Draw, world: World, along: Along, placed: Sequence[tuple[str, int]]) -> Items | None:
    """Causes of 1 to 30 % of the torque; None where one cannot be, or where presliding would hide it."""
    least = max(SIZES[0], _least(world, along, [axis for effect, axis in placed if effect == "presliding"]) if placed else 0.0)
    if least >= SIZES[1]:
        return None
    causes: Items = ()
    for effect, axis in placed:
        size = float(np.exp(draw.uniform(np.log(least), np.log(SIZES[1]))))
        made: Callable[[Ground], Sizable] = {**LIBRARY, **FOREIGN}[effect]
        cause, reached = along.sized(world, effect, made(along.ground(draw, world, axis)), axis, size, causes)
        if reached < _REACHED * SIZES[0]:
            return None
        causes = (*causes, cause)
    return causes


def _least(world: World, along: Along, own: Sequence[int]) -> float:
    """Size below which a cause is hidden by presliding, be it the stiffest on every axis that has none as its cause."""
    stiff = replace(world, micro=tuple(float(way) for way in _stiffest(world)))
    costs = along.presliding(stiff) / along.torque
    worst = max((float(cost) for k, cost in enumerate(costs) if k not in own), default=0.0)
    return float(worst / HIDDEN**0.5)


def _stiffest(world: World) -> Array:
    return np.array([yielding_way(link.slide)[0] for link in world.machine.links])


def stiffened(world: World, along: Along, causes: Items, scales: Array) -> tuple[World, bool]:
    """The world in which presliding costs a tenth of the energy of a cause of size `scales` (n,), or less where it can be.

    Also whether it hides none where it is stiffest.
    """
    least = _stiffest(world)
    free = np.array([not has_presliding(causes, name) for name in world.names])
    for _ in range(_STEPS):
        over = along.presliding(world) / (BESIDE[1] ** 0.5 * scales * along.torque)
        micro = np.array(world.micro)
        loud = free & (over > 1.0) & (micro > least)
        if not loud.any():
            break
        softer = np.maximum(least, micro * np.minimum(0.5, over**-2.0))
        world = replace(world, micro=tuple(float(f"{way:.6g}") for way in np.where(loud, softer, micro)))
    return world, bool((over[free] < (1.5 * HIDDEN / BESIDE[1]) ** 0.5).all())


def sized_nuisances(draw: Draw, world: World, along: Along, causes: Items, own: Sequence[int], scales: Array) -> Items:
    """Two to four small effects beside causes of size `scales` (n,); three in four on an axis in `own`, no kind twice."""
    found: Items = ()
    for number in range(int(draw.integers(2, 5))):
        near = own and (number == 0 or draw.random() < 0.75)
        axis = int(draw.choice(own)) if near else int(draw.integers(len(world.names)))
        taken = {item.effect for item in (*causes, *found) if item.axis == world.names[axis]}
        name = str(draw.choice([name for name in NUISANCES if name not in taken and suits(name, world.machine, axis)]))
        size = float(draw.uniform(*BESIDE)) ** 0.5 * float(scales[axis])
        made = NUISANCES[name](along.ground(draw, world, axis))
        found = (*found, along.sized(world, name, made, axis, size, (*causes, *found))[0])
    return found


def has_presliding(causes: Items, axis: str) -> bool:
    """Whether presliding is a cause on an axis."""
    return any(cause.effect == "presliding" and cause.axis == axis for cause in causes)
