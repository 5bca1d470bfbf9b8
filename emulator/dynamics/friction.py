"""Friction of a joint: its law, and how it acts in MuJoCo, whose own constraint models stiction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, inf, pi, sin

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.motion import Motion, Wave
from drivetwin.emulator.dynamics.place import Place
from drivetwin.emulator.dynamics.records import records
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.compiled import compiled, in_place

BRISTLES = 4
"""Elements of the Maxwell-slip model."""
MOST_OF_LOAD = 0.9
"""Share of the motor torque that friction takes at most: with all of it an axis locks itself."""


@dataclass(frozen=True)
class FrictionLaw:
    """Torque of friction on one joint; N·m, rad, s (N, m, s).

    torque = -w [level sgn(v) + coulomb_asymmetry + (viscous + viscous_asymmetry sgn(v) + quadratic |v| + cubic v²) v]
    level = coulomb + (static_torque - coulomb) exp(-(|v|/stribeck_velocity)^exponent)
            + load_coefficient |motor torque| + position_amplitude sin(2 pi q / position_period + position_phase)
    w = 1 + cold exp(-t / warming_time)

    At rest the joint holds up to w level: rigidly, or on bristles of `presliding_stiffness` and `presliding_damping`
    where the stiffness is not 0. Sources are with the effects that change the law.
    """

    coulomb: float = 0.0
    coulomb_asymmetry: float = 0.0
    viscous: float = 0.0
    viscous_asymmetry: float = 0.0
    quadratic: float = 0.0
    cubic: float = 0.0
    static_torque: float = 0.0
    stribeck_velocity: float = 0.0
    exponent: float = 2.0
    load_coefficient: float = 0.0
    position_amplitude: float = 0.0
    position_period: float = 1.0
    position_phase: float = 0.0
    cold: float = 0.0
    warming_time: float = 1.0
    presliding_stiffness: float = 0.0
    presliding_damping: float = 0.0

    @cached_property
    def record(self) -> np.void:
        """As compiled code reads it."""
        found: np.void = records((FrictionLaw,), [(self,)])[0]
        return found

    @property
    def acts(self) -> bool:
        """Whether it depends on more than the velocity, or gives way before it slides."""
        return any((self.load_coefficient, self.position_amplitude, self.cold, self.presliding_stiffness))

    def scaled(self, share: float) -> FrictionLaw:
        """A law of the same form with `share` of every torque: one side of a transmission bears so much."""
        return replace(self, **{name: share * getattr(self, name) for name in _TORQUES})

    @cached_property
    def dry(self) -> FrictionLaw:
        """The law without what vanishes with the velocity: what jumps at a reversal."""
        return replace(self, viscous=0.0, viscous_asymmetry=0.0, quadratic=0.0, cubic=0.0)

    @property
    def least_slope(self) -> float:
        """Least of viscous - |viscous_asymmetry| + quadratic s + cubic s² over all speeds s; below 0 it would push."""
        start = self.viscous - abs(self.viscous_asymmetry)
        if self.cubic > 0.0:
            turn = max(0.0, -self.quadratic / (2.0 * self.cubic))
            return start + self.quadratic * turn + self.cubic * turn**2
        return start if self.quadratic >= 0.0 and self.cubic == 0.0 else -inf

    def resistance(self, motion: Motion) -> NDArray[np.float64]:
        """Torque against the motion, (n,), in sliding; zero at rest, where stiction holds what it must; or that of bristles."""
        torque = np.empty_like(motion.velocity)
        varying, share = self.varying_level(motion), self._stribeck_share(motion)
        _resist(self.record, self.warmth(motion), varying, share, motion.position, motion.velocity, torque)
        return torque

    def _stribeck_share(self, motion: Motion) -> NDArray[np.float64]:
        """exp(-(|v|/stribeck_velocity)^exponent) on the way, (n,)."""
        if not self.stribeck_velocity > 0.0:
            return _nothing(motion)
        velocity, exponent = self.stribeck_velocity, self.exponent
        return motion.kept_lately(("stribeck", velocity, exponent), lambda same: _shares(same.velocity, velocity, exponent))

    def varying_level(self, motion: Motion) -> NDArray[np.float64]:
        """The part of level, (n,), that load and position make; shared, not to be written to."""
        if self.load_coefficient == 0.0 and self.position_amplitude == 0.0:
            return _nothing(motion)
        wave = self._wave(motion)
        if self.load_coefficient == 0.0:
            return wave
        return motion.kept_lately(("loaded", self), lambda same: wave + self._of_load(same))

    def _wave(self, motion: Motion) -> NDArray[np.float64]:
        height, period, phase = self.position_amplitude, self.position_period, self.position_phase
        if height == 0.0:
            return _nothing(motion)

        def made(same: Motion) -> NDArray[np.float64]:
            return height * same.wave(2.0 * pi * same.position / period + phase, 2.0 * pi / period)

        return motion.kept_lately(("wave", height, period, phase), made)

    @property
    def of_position(self) -> tuple[float, ...]:
        """What its wave over the position depends on; nothing where it has none."""
        if self.position_amplitude == 0.0:
            return ()
        return self.position_amplitude, self.position_period, self.position_phase, self.cold, self.warming_time

    def unseen(self, motion: Motion, truth: Motion) -> Wave | None:
        """The torque of the friction that goes with the position, on the true way, as far as no recording shows how it moves
        the joint; None: nowhere.
        """
        if self.position_amplitude == 0.0:
            return None
        number = 2.0 * pi / self.position_period
        wave = motion.unseen_wave(number * truth.position + self.position_phase, number)
        if wave is None:
            return None
        height = -self.position_amplitude * self.warmth(truth) * np.sign(truth.velocity)
        return replace(wave.times(height), followed=False, pushes=1.0)

    def _of_load(self, motion: Motion) -> NDArray[np.float64]:
        """load_coefficient |T|, (n,), of the motor torque that the axis asks for in sliding, (L + w F) / (1 - w c sgn(T v)).

        The measured torque would explain itself, the better the larger the coefficient c. L is the rigid machine's torque as
        modelled, with the loads that the axis has; w F the other friction.
        """
        rest = replace(self, load_coefficient=0.0, presliding_stiffness=0.0, presliding_damping=0.0)
        needed = motion.rigid_torque + motion.kept_lately(rest, rest.resistance)
        warmth = self.warmth(motion)
        share = self.load_coefficient * warmth
        drives = needed * motion.velocity > 0.0
        share = np.where(drives, np.minimum(share, MOST_OF_LOAD), share)
        asked = needed / (1.0 - share * np.sign(needed * motion.velocity))
        return np.asarray(share / warmth * np.abs(asked))

    def warmth(self, motion: Motion) -> NDArray[np.float64]:
        """w on the way, (n,); shared, not to be written to."""
        if self.cold == 0.0:
            return motion.kept("warm", lambda same: np.ones_like(same.time))
        time = self.warming_time
        return np.asarray(1.0 + self.cold * motion.kept_lately(("cold", time), lambda same: np.exp(-same.time / time)))


_TORQUES = (
    *("coulomb", "coulomb_asymmetry", "viscous", "viscous_asymmetry", "quadratic", "cubic", "static_torque"),
    *("load_coefficient", "position_amplitude", "presliding_stiffness", "presliding_damping"),
)
"""Fields of a law in which its torque is linear."""


def _nothing(motion: Motion) -> NDArray[np.float64]:
    return motion.kept("nothing", lambda same: np.zeros_like(same.velocity))


@compiled
def _shares(velocity, stribeck_velocity, exponent):  # type: ignore[no-untyped-def]
    shares = np.empty_like(velocity)
    for k in range(velocity.shape[0]):
        shares[k] = exp(-((abs(velocity[k]) / stribeck_velocity) ** exponent))
    return shares


@in_place
def level_at(law, speed):  # type: ignore[no-untyped-def]  # record arrays have no static type
    level = law.coulomb
    if law.stribeck_velocity > 0.0:
        level += (law.static_torque - law.coulomb) * np.exp(-((speed / law.stribeck_velocity) ** law.exponent))
    return level


@in_place
def apply_friction(laws, brakes, velocity, frictionloss, applied) -> None:  # type: ignore[no-untyped-def]
    """Set what MuJoCo's friction constraint may hold and what acts beside it, for laws (n,), from qvel (nv,).

    Laws of joints stand before those of motors that move by themselves.

    Native `frictionloss` does the sticking and, once a limit is reached, gives exactly that limit; the law only moves the
    limit with the speed. A limit that differs with the direction is a symmetric one beside a constant torque.
    """
    for row in range(laws.shape[0]):
        law = laws[row]
        speed = abs(velocity[law.dof])
        frictionloss[law.motor_dof] = 0.0
        frictionloss[law.dof] = level_at(law, speed)
        if brakes[law.axis]:
            frictionloss[law.motor_dof] += law.brake
        applied[law.motor_dof] = 0.0
        applied[law.dof] = -law.coulomb_asymmetry - law.viscous_asymmetry * speed


@in_place
def vary_friction(  # type: ignore[no-untyped-def]
    laws, anchors, brakes, time, position, velocity, torque, frictionloss, applied, damping, polynomial
) -> None:
    """What load, position and time change of laws (n,), and bristles (n, BRISTLES) that stick elastically."""
    for row in range(laws.shape[0]):
        law = laws[row]
        q, v = position[law.qpos], velocity[law.dof]
        warmth = 1.0 + law.cold * exp(-time / law.warming_time)
        level = level_at(law, abs(v)) + law.load_coefficient * abs(law.gear * torque[law.actuator])
        level += law.position_amplitude * sin(2.0 * pi * q / law.position_period + law.position_phase)
        level = max(0.0, warmth * level)
        applied[law.dof] *= warmth
        damping[law.dof] = warmth * law.viscous
        polynomial[law.dof, 0] = warmth * law.quadratic
        polynomial[law.dof, 1] = warmth * law.cubic
        if law.presliding_stiffness > 0.0:
            applied[law.dof] -= bristles_torque(law, anchors[row], level, q, v)
            level = 0.0
        if brakes[law.axis] and law.motor_dof == law.dof:
            level += law.brake
        frictionloss[law.dof] = level


@in_place
def bristles_torque(law, anchors, level, q, v):  # type: ignore[no-untyped-def]
    """Maxwell slip: springs of equal stiffness, the i-th of which slips when stretched by i shares; all slip at `level`."""
    stiffness, damping = law.presliding_stiffness / BRISTLES, law.presliding_damping / BRISTLES
    return drag_bristles(anchors, slip_share(law, level), stiffness, damping, q, v)


@in_place
def slip_share(law, level):  # type: ignore[no-untyped-def]
    """By how much more each of the bristles is stretched than the one before when it slips."""
    return 2.0 * level / (law.presliding_stiffness * (BRISTLES + 1))


@in_place
def drag_bristles(anchors, share, stiffness, damping, q, v):  # type: ignore[no-untyped-def]
    """Torque of bristles at a position and speed, of which each has a `stiffness` and a `damping`; the anchors are dragged."""
    torque = 0.0
    for i in range(BRISTLES):
        slips_at = (i + 1) * share
        stretch = q - anchors[i]
        if abs(stretch) < slips_at:
            torque += damping * v
        else:
            stretch = slips_at if stretch > 0.0 else -slips_at
            anchors[i] = q - stretch
        torque += stiffness * stretch
    return torque


@compiled
def _resist(law, warmth, varying, share, position, velocity, torque) -> None:  # type: ignore[no-untyped-def]
    """Torque (n,) of friction on a motion (n,), from its warmth, varying level and Stribeck share; bristles begin relaxed."""
    anchors = np.full(BRISTLES, position[0])
    for k in range(velocity.shape[0]):
        v, speed = velocity[k], abs(velocity[k])
        direction = 1.0 if v > 0.0 else -1.0 if v < 0.0 else 0.0
        level = warmth[k] * (law.coulomb + varying[k] + (law.static_torque - law.coulomb) * share[k])
        if law.presliding_stiffness > 0.0:
            held = bristles_torque(law, anchors, max(0.0, level), position[k], v)
        else:
            held = direction * level
        slope = law.viscous + direction * law.viscous_asymmetry + law.quadratic * speed + law.cubic * speed**2
        torque[k] = held + warmth[k] * (abs(direction) * law.coulomb_asymmetry + slope * v)


@dataclass(frozen=True)
class _Side:
    """Where a share of an axis's friction acts: on its joint, or on a motor that moves by itself."""

    law: FrictionLaw
    place: Place
    share: float


class Friction:
    """The friction of every axis in a MuJoCo model: `laws` for `apply_friction`, those of the joints (n,), then of the motors.

    `motor_shares` (n,): of each axis's friction, how much acts on its motor, which then moves by itself. `varying` and
    `anchors`, for `vary_friction`, are those where it depends on more than the velocity.
    """

    def __init__(
        self, laws: Sequence[FrictionLaw], motor_shares: Sequence[float], places: Sequence[Place], data: mujoco.MjData
    ) -> None:
        axes = list(zip(laws, motor_shares, places, strict=True))
        joints = [_Side(law, place, 1.0 - share) for law, share, place in axes]
        at_motors = [(law, share, replace(place, qpos=place.motor_qpos, dof=place.motor_dof)) for law, share, place in axes]
        sides = [*joints, *(_Side(law, place, share) for law, share, place in at_motors if share > 0.0)]
        acting = [side for side in sides if side.law.acts]
        self.laws, self.varying = _records(sides), _records(acting)
        self._shares = [np.array([side.share for side in each]) for each in (sides, acting)]
        self.anchors = np.repeat(data.qpos[self.varying["qpos"]][:, None], BRISTLES, axis=1)

    def set_level(self, axis: int, law: FrictionLaw) -> None:
        """Let an axis have the coulomb friction and the stiction of another law from now on."""
        for laws, shares in zip((self.laws, self.varying), self._shares, strict=True):
            meant = laws["axis"] == axis
            laws["coulomb"][meant] = shares[meant] * law.coulomb
            laws["static_torque"][meant] = shares[meant] * law.static_torque


def _records(sides: Sequence[_Side]) -> NDArray[np.void]:
    return records((FrictionLaw, Place), [(side.law.scaled(side.share), side.place) for side in sides])
