"""A measured motion of one axis, with the quantities that effects derive their torque from."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.sampling import Sampling
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.lately import Lately

LATELY = 16
"""Results of a search that are kept of one motion: of the effect as it stands and of its neighbours."""
CHANGED = 5
"""Motions made of one that are kept: each keeps as much itself."""
WAVES = 8
"""Shares of waves that are kept, by how fast the wave turns on the way."""


@dataclass(frozen=True)
class Wave:
    """What passes an axis at a `frequency` (n,) [Hz]: the imaginary part of what is `rotating` (n,), forward in time.

    `followed`: an error of encoder or gear, which the loops follow, by the acceleration that the joint has beyond its reading
    or its motor [rad/s² or m/s²]; else a torque on the joint [N·m or N]. `pushes`: torque on the joint a unit of it; of
    an error of the gear the inertia of the rotor [kg·m² or kg]. `late` [s]: by which the encoder is read late, and the wave
    with it; `heavier` [kg·m² or kg]: by which its axis is heavier than modelled.
    """

    rotating: NDArray[np.complex128]
    frequency: NDArray[np.float64]
    followed: bool = True
    pushes: float = 0.0
    late: float = 0.0
    heavier: float = 0.0

    def times(self, size: NDArray[np.float64] | float) -> Wave:
        """The same, by a factor (n,) larger."""
        return replace(self, rotating=np.asarray(self.rotating * size))


@dataclass(frozen=True)
class Motion:
    """Joint side, each (n,): rad, rad/s, rad/s², N·m (m, m/s, m/s², N); `time` [s] since the plant was switched on.

    Position, as the encoder tells it, and its derivatives; `torque` is the motor's as the drive reports it, times the gear
    ratio. `rigid_torque` is what the frictionless rigid machine needs for this motion, `inertia` its d torque / d acceleration,
    both with the motor; `rotor_inertia` is the motor's share of it. `from_others`: what of `rigid_torque` the other axes'
    accelerations cost. `band`: the highest frequency that the motion holds [Hz]. `deflection`: how far a second encoder has the
    joint ahead of its motor [rad or m], less its mean; None without one. `weight_slope`: d weight / d position of the joint
    itself [N·m/rad or N/m]. `unique`: the length within which a position means the same in all that was recorded [rad or m].
    `sampling`: of a torque whose drive's loops are known. Samples stand in equal steps.
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    torque: NDArray[np.float64]
    time: NDArray[np.float64]
    rigid_torque: NDArray[np.float64]
    inertia: NDArray[np.float64]
    rotor_inertia: float
    from_others: NDArray[np.float64] | float = 0.0
    band: float = inf
    deflection: NDArray[np.float64] | None = None
    weight_slope: NDArray[np.float64] | float = 0.0
    unique: float = inf
    sampling: Sampling | None = None
    _kept: dict[Hashable, NDArray[np.float64]] = field(init=False, repr=False, compare=False, default_factory=dict)
    _lately: Lately[Hashable, NDArray[np.float64]] = field(init=False, repr=False, compare=False, default_factory=Lately)
    _waves: Lately[Hashable, NDArray[np.float64]] = field(init=False, repr=False, compare=False, default_factory=Lately)
    _unseen: Lately[float, tuple[NDArray[np.float64], NDArray[np.float64]]] = field(
        init=False, repr=False, compare=False, default_factory=Lately
    )
    _changed: Lately[Hashable, Motion] = field(init=False, repr=False, compare=False, default_factory=Lately)

    def kept(self, key: Hashable, made: Callable[[Motion], NDArray[np.float64]]) -> NDArray[np.float64]:
        """What is made of this motion for a key, made once: what every effect that is tried on an axis asks again."""
        if key not in self._kept:
            self._kept[key] = made(self)
        return self._kept[key]

    def kept_lately(self, key: Hashable, made: Callable[[Motion], NDArray[np.float64]]) -> NDArray[np.float64]:
        """The same for keys that a search moves on from: the `LATELY` last asked for are kept."""
        return self._lately.get(key, lambda: made(self), LATELY)

    def changed_lately(self, key: Hashable, made: Callable[[Motion], Motion]) -> Motion:
        """The same of a motion that is made of this one: of the axis with another load, of what an encoder misread."""
        return self._changed.get(key, lambda: made(self), CHANGED)

    def of_a_late_encoder(self, delay: float) -> Motion:
        """The same, of a drive that reads its encoder `delay` [s] late."""
        sampling = self.sampling
        if sampling is None or delay == 0.0:
            return self
        return self.changed_lately(("late", delay), lambda same: replace(same, sampling=sampling.of_a_late_encoder(delay)))

    def wave(self, angle: NDArray[np.float64], number: float) -> NDArray[np.float64]:
        """sin(angle), (n,), as a torque that disturbs the axis shows it.

        `number`: by how much the angle grows on the way [rad/rad or rad/m].
        """
        if self._shows_all(number):
            return np.sin(angle)
        gain, turned = self._waves.get(("seen", number), lambda: self._seen(number), WAVES)
        return np.asarray(gain * np.sin(angle + turned))

    def known_wave(self, angle: NDArray[np.float64], number: float) -> NDArray[np.float64]:
        """sin(angle), (n,), as far as a recorded motion shows an acceleration that passes so fast; `number` as of `wave`."""
        if self._shows_all(number):
            return np.sin(angle)
        sampling = self.sampling
        assert sampling is not None
        share = self._waves.get(("known", number), lambda: sampling.known(self._frequency(number)), WAVES)
        return np.asarray(share * np.sin(angle))

    def unseen_wave(self, angle: NDArray[np.float64], number: float) -> Wave | None:
        """sin(angle) of an acceleration or a torque that passes so fast, as far as no recording shows it; None where it shows
        all, or the loops of the drive are unknown. `number` as of `wave`.
        """
        if self._shows_all(number):
            return None
        frequency, share = self._unseen.get(number, lambda: self._share_unseen(number), WAVES)
        if not share.any():
            return None
        ways = np.sign(number * self.velocity)
        return Wave(np.asarray(ways * share * np.exp(1j * ways * angle), dtype=np.complex128), frequency)

    def _shows_all(self, number: float) -> bool:
        """Whether such a wave passes so slowly that the recorded motion shows all of it; with unknown loops it is taken so."""
        if self.sampling is None:
            return True
        known_to = min(self.sampling.known_to, 0.5 / self.period)
        return abs(number) * self._top_speed <= 2.0 * pi * known_to

    @cached_property
    def _top_speed(self) -> float:
        return float(np.abs(self.velocity).max(initial=0.0))

    def _share_unseen(self, number: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        assert self.sampling is not None
        frequency = self._frequency(number)
        return frequency, self.sampling.unseen(frequency, self.period)

    def _seen(self, number: float) -> NDArray[np.float64]:
        """By how much a wave is larger, and by which angle it is ahead in position, (2, n)."""
        assert self.sampling is not None
        share = self.sampling.seen(self._frequency(number), self.period)
        return np.stack([np.abs(share), np.sign(number * self.velocity) * np.angle(share)])

    def _frequency(self, number: float) -> NDArray[np.float64]:
        """With which a wave of so many radians on the way passes, (n,) [Hz]."""
        return np.abs(number * self.velocity) / (2.0 * pi)

    @property
    def weight(self) -> NDArray[np.float64]:
        """What the rigid machine needs beside its inertia, (n,); shared, not to be written to."""
        return self.kept("weight", lambda same: same.rigid_torque - same.inertia * same.acceleration)

    @property
    def link(self) -> NDArray[np.float64]:
        """Inertia behind the motor, (n,); shared, not to be written to."""
        return self.kept("link", lambda same: same.inertia - same.rotor_inertia)

    @property
    def period(self) -> float:
        """Between two samples [s]."""
        return float(self.time[1] - self.time[0])
