"""Friction that gives way elastically before it slides: micro-displacement with hysteresis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log, pi, sqrt
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import DAMPING, STIFFNESS, Exciting, Look, Need, Parameter, PartEffect, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.waves import travel

_WAYS = 16
_DAMPED = (0.0, 1.0)
"""Damping ratios of bristles, with the axis on them, that a search starts from."""


@dataclass(frozen=True)
class Presliding(PartEffect):
    """At rest the friction is a spring of `stiffness` that yields little by little until, all at its level, it slides.

    Maxwell slip with four elements of equal stiffness that slip at 1/4, 2/4, 3/4 and 4/4 of 1.6 level / stiffness, each
    damped by a quarter of `damping` while it sticks; elasto-plastic, so it does not drift. Al-Bender, Lampaert, Swevers,
    IEEE Trans. Automatic Control 50(11), 2005, without the lag of sliding friction.
    """

    name: ClassVar[str] = "presliding"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.REVERSALS})
    scales: ClassVar[bool] = False
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SMALL_REVERSALS})
    by_motion: ClassVar[str] = "small slow reversals, smaller than the presliding way"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LEVEL, Look.PLAY})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
    )

    stiffness: float
    damping: float = 0.0

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        law = replace(axis.friction, presliding_stiffness=self.stiffness, presliding_damping=self.damping)
        return replace(axis, friction=law)

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """What gives way over more than twice the largest way of real friction is play or a spring."""
        bounds = super().bounds(motion, axis)
        return bounds | {"stiffness": (max(bounds["stiffness"][0], _level(axis) / (2.0 * _largest_way(axis))), np.inf)}

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        """A tenth of critical damping of the axis on its bristles changes as much as none and all do."""
        swings = 0.2 * sqrt(self.stiffness * max(float(np.median(motion.inertia)), 0.0))
        return super().sizes(motion, axis) | {"damping": max(self.damping, swings) or 1.0}

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """Friction gives way over some 10 um to 1 mm, 0.1 to 10 mrad: Armstrong-Helouvry et al., Automatica 30(7), 1994."""
        way = _level(axis) / self.stiffness
        return 0.5 * (max(0.0, log(max(way, 1e-12) / _largest_way(axis))) / log(2.0)) ** 2

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        """From the way that a reversal takes within the time constant of the motion's filter, on which nothing less is seen.

        Each without damping and critically damped: a search from the wrong side stops on the ridge between them.
        """
        level, longest = _level(axis), 0.1 * travel(motion)
        if level * longest == 0.0:
            return []
        shortest = 0.5 * float(np.sqrt(np.mean(motion.acceleration**2))) / (2.0 * pi * motion.band) ** 2
        least = np.clip(shortest, 1e-5 * longest, 1e-3 * longest)
        ways = np.minimum(np.geomspace(least, longest, _WAYS), 1.6 * _largest_way(axis))
        stiffnesses = [1.6 * level / float(way) for way in np.unique(ways)]
        critical = 2.0 * sqrt(max(float(np.median(motion.inertia)), 0.0))
        ratios = _DAMPED if critical > 0.0 else _DAMPED[:1]
        return [cls._start(each, ratio * critical * sqrt(each)) for each in stiffnesses for ratio in ratios]

    @classmethod
    def drawn(cls, ground: Ground) -> Presliding:
        way = ground.draw.uniform(0.002, 0.008) * ground.room
        stiffness = 1.6 * ground.axis.friction.coulomb / way
        return cls(stiffness, 2.0 * ground.draw.uniform(0.05, 0.2) * sqrt(stiffness * ground.inertia))

    @classmethod
    def _start(cls, stiffness: float, damping: float) -> Start:
        """What it costs grows about as the way on which it yields."""

        def compose(found: Sequence[float]) -> Presliding | None:
            if found[0] <= 0.0:
                return None
            softer = min(max(found[0], 0.5), 2.0)
            return cls(stiffness / softer, damping / sqrt(softer))

        return Start((cls(stiffness, damping),), compose)


def _level(axis: AxisDynamics) -> float:
    return max(axis.friction.coulomb, axis.friction.static_torque)


def _largest_way(axis: AxisDynamics) -> float:
    """On which real friction gives way [m or rad]."""
    return 1e-3 if axis.slide else 1e-2
