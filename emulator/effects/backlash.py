"""Play between motor and joint: they meet on one flank or the other, and part in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import DAMPING, NUMBER, POSITION, STIFFNESS, Exciting, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.seen_deflection import plays_seen
from drivetwin.emulator.effects.springs import damped, springs, tenth_of_critical, too_soft
from drivetwin.emulator.effects.transmission_effect import SIDES, TransmissionEffect
from drivetwin.emulator.effects.waves import travel

_FLANKS = (15.0, 45.0)
"""How fast the link swings on a flank of a locked motor [Hz]."""
_CROSSING_TIMES = (0.003, 0.08)
"""From flank to flank [s]."""
_SHARES = (1e-3, 0.08)
"""Of the travel, that a gap may be."""
_GAPS = 8
LARGEST_GAP = (0.02, 0.2)
"""Of a slide [m], of a hinge [rad]."""


@dataclass(frozen=True)
class Backlash(TransmissionEffect):
    """Torque = 0 while |m - q| < gap / 2, else stiffness (|m - q| - gap / 2) sgn(m - q) + damping (m' - q'), which never pulls.

    m, q, armature and the sides of friction as with `elasticity`, whose compliance adds. `gap` is the whole lost motion.
    The dead zone of Nordin and Gutman, Automatica 38(10), 2002.
    """

    name: ClassVar[str] = "backlash"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.REVERSALS})
    scales: ClassVar[bool] = False
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SMALL_REVERSALS, Exciting.SWEEP})
    by_motion: ClassVar[str] = "slow reversals with a light load, at several positions"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PLAY})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("gap", POSITION, low=0.0),
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
        Parameter("motor_friction_share", NUMBER, low=0.0, high=1.0),
    )

    gap: float
    stiffness: float
    damping: float = 0.0
    motor_friction_share: float = 0.0

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """A gear has minutes of arc of play, a hobby servo a degree or two: what has ten times that is no drive train."""
        return super().bounds(motion, axis) | {"gap": (0.0, LARGEST_GAP[0] if axis.slide else LARGEST_GAP[1])}

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        """Of a gap that is closed, what the flanks give way under the axis's torque: a smaller step would change nothing."""
        gives = float(np.sqrt(np.mean(motion.torque**2))) / self.stiffness
        damping = self.damping or tenth_of_critical(motion, self.stiffness)
        return super().sizes(motion, axis) | {
            "gap": self.gap or gives or 1.0,
            "damping": damping or 1.0,
            "motor_friction_share": 1.0,
        }

    def natural(self, axis: AxisDynamics) -> Backlash | None:
        """With all friction behind the spring, as most models have it: a parameter less."""
        return replace(self, motor_friction_share=0.0) if self.motor_friction_share > 0.0 else None

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        return frozenset() if self.motor_friction_share > 0.0 else frozenset({"motor_friction_share"})

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        return too_soft(motion, self.stiffness)

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        """By how long a link that coasts takes from flank to flank while the motor turns back, and by shares of the travel.

        Where friction holds the link, the flanks are also tried that its friction bends by half a gap; and the play that a
        second encoder shows.
        """
        turns, way = float(np.sqrt(np.mean(motion.acceleration**2))), travel(motion)
        coasting = 0.5 * turns * np.geomspace(*_CROSSING_TIMES, _GAPS) ** 2
        held = way * np.geomspace(*_SHARES, _GAPS)
        flanks = [spring for at in _FLANKS for spring in springs(motion, at, (0.2,))]
        tried = [(float(gap), flank) for flank in flanks for gap in (*coasting, *held) if gap < 0.1 * way]
        level = max(axis.friction.coulomb, axis.friction.static_torque)
        if level > 0.0 and flanks and way > 0.0:
            link = float(np.median(motion.inertia)) - motion.rotor_inertia
            tried += [(float(gap), (float(2.0 * level / gap), float(0.4 * np.sqrt(2.0 * level / gap * link)))) for gap in held]
        for gap, stiffness in plays_seen(motion, axis):
            tried += [(gap, flank) for flank in damped(motion, stiffness, (0.05, 0.2))]
        return [cls._start(gap, flank, share) for share in SIDES for gap, flank in tried]

    @classmethod
    def drawn(cls, ground: Ground) -> Backlash:
        gap = ground.draw.uniform(0.00008, 0.0003) * ground.room
        flank = ground.spring(ground.draw.uniform(40.0, 70.0), ground.draw.uniform(0.1, 0.3))
        return cls(gap, *flank, ground.draw.uniform(0.0, 0.8))

    @classmethod
    def _start(cls, gap: float, flank: tuple[float, float], share: float) -> Start:
        """What it costs grows about as the gap."""

        def compose(found: Sequence[float]) -> Backlash | None:
            return cls(gap * min(max(found[0], 0.8), 1.25), *flank, share) if found[0] > 0.0 else None

        return Start((cls(gap, *flank, share),), compose)

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        meshing = axis.transmission.in_series(self.stiffness, self.damping, self.motor_friction_share)
        return replace(axis, transmission=replace(meshing, gap=self.gap))
