"""Effects between the torque that a drive's loops ask for and the torque that it gives: seen without the plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from drivetwin.diagnosis.prepare.drive_law import Asked, drive_candidates, known_laws, law_holds, left_by
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.propose.nominal import timing_error
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import DriveEffect, Effect
from drivetwin.emulator.effects.current_bandwidth import CurrentBandwidth

Array = NDArray[np.float64]

USUAL_BANDWIDTHS = (200.0, 300.0, 450.0, 700.0, 1000.0)
"""Of a sound servo drive's current loop [Hz]."""
LATEST = 6.0
"""Deviations of the timing, up to which another time to read the torque is sought."""
SLOW = 0.8
"""Share of the least usual bandwidth below which a current loop is slow."""
LIKE_ONE = 10.0
"""Rows that tell as much as one."""


@dataclass(frozen=True)
class Missed:
    """What a law misses of the torque of each recording: mean squares (R,) [(N·m)² or N²] over `rows` (R,)."""

    squares: Array
    rows: Array

    @property
    def mean(self) -> float:
        """Mean square over the rows of all recordings."""
        return float(self.squares @ self.rows) / max(float(self.rows.sum()), 1.0)

    def most_over(self, other: Missed, whole: Missed) -> float:
        """What it misses more than another, as a share of a `whole`, in the recording in which that is most."""
        return float(np.max((self.squares - other.squares) / np.maximum(whole.squares, 1e-300), initial=0.0))

    @property
    def unlikely(self) -> float:
        """Negative log likelihood [nats] but for a constant, each recording with its own level of noise: at a low rate the law
        itself is known worse."""
        return float(self.rows @ np.log(np.maximum(self.squares, 1e-300))) / (2.0 * LIKE_ONE)


@dataclass(frozen=True)
class DriveFound:
    """An effect of one axis's drive, and what the law misses without it and with it."""

    axis: str
    effect: DriveEffect
    without: Missed
    left: Missed

    @property
    def gain(self) -> float:
        """Nats that its one parameter brings."""
        return _nats(self.without, self.left)


def drive_effects(runs: Sequence[Run], axis: str, kinds: Sequence[type[Effect]], settings: Settings) -> list[DriveFound]:
    """The best effect on an axis whose law holds, and after it the best of the others beside those that were found.

    It has to take a least share of what the law alone leaves. With it the law has to give the recorded torque: otherwise, at
    one constant speed, a limit far below the torque would fit as well. One that does not is asked again beside the next: a
    limit behind a slow current loop. A slow loop is not reported where a torque that is recorded late is more probable: motion
    alone does not show that where an unknown torque hides it.
    """
    law = _Law(axis, known_laws(runs, axis))
    tried = [effect for effect in (drive_candidates(law.known) if law.known else []) if type(effect) in kinds]
    tried = [effect for effect in tried if not _usual(effect)]
    if not tried:
        return []
    found: list[DriveFound] = []
    without = whole = min((law.missed(usual) for usual in _as_commissioned()), key=lambda one: one.unlikely)
    refused: list[DriveEffect] = []
    while open_ones := [effect for effect in tried if all(effect is not one for one in refused)]:
        beside = tuple(one.effect for one in found)
        begun = min(open_ones, key=lambda effect: law.missed((*beside, effect)).unlikely)
        best = law.moved(begun, beside)
        left = law.missed((*beside, best))
        if without.most_over(left, whole) < settings.least_share:
            break
        one = DriveFound(axis, best, without, left)
        if not law_holds(law.known, axis, (*beside, best)):
            refused.append(begun)
            continue
        if isinstance(best, CurrentBandwidth) and _gain_of_reading(runs, beside, one, settings) >= one.gain:
            refused += [effect for effect in tried if isinstance(effect, CurrentBandwidth)]
            continue
        found.append(one)
        without, refused = left, []
        tried = [effect for effect in tried if type(effect) is not type(best)]
    return found


@dataclass(frozen=True)
class _Law:
    """What the loops of one axis asked for in each recording that tells it."""

    axis: str
    known: Sequence[tuple[Run, Asked]]

    def missed(self, effects: Sequence[DriveEffect]) -> Missed:
        """What the law misses with effects of the drive."""
        rows = [left_by(run, self.axis, asked, effects) for run, asked in self.known]
        squares = np.array([float(np.mean(each**2)) if len(each) else 0.0 for each in rows])
        return Missed(squares, np.array([float(len(each)) for each in rows]))

    def moved(self, effect: DriveEffect, beside: Sequence[DriveEffect]) -> DriveEffect:
        """An effect's one parameter moved to where it is likeliest, a little to either side."""
        parameter = type(effect).parameters[0]
        value = float(getattr(effect, parameter.name))

        def unlikely(logarithm: float) -> float:
            return self.missed((*beside, replace(effect, **{parameter.name: float(np.exp(logarithm))}))).unlikely

        bounds = np.log(value / 1.6), np.log(value * 1.3)
        solved = minimize_scalar(unlikely, bounds=bounds, method="bounded", options={"xatol": 2e-3})
        return replace(effect, **{parameter.name: float(np.clip(np.exp(solved.x), parameter.low, parameter.high))})


def _nats(without: Missed, left: Missed) -> float:
    """Log evidence of one parameter: half the logarithm of the number of rows it costs."""
    count = max(float(left.rows.sum()) / LIKE_ONE, 2.0)
    return without.unlikely - left.unlikely - 0.5 * float(np.log(count))


def _gain_of_reading(runs: Sequence[Run], beside: Sequence[DriveEffect], one: DriveFound, settings: Settings) -> float:
    """Nats that it brings instead of an effect to read the torque at another time than by the motion, less what that costs."""
    spread = timing_error(runs, settings)

    def lost(shift: float) -> float:
        law = _Law(one.axis, known_laws([run.aligned({one.axis: shift}) for run in runs], one.axis))
        return 0.5 * (shift / spread) ** 2 - _nats(one.without, law.missed(beside))

    most = LATEST * spread
    return -float(minimize_scalar(lost, bounds=(-most, most), method="bounded", options={"xatol": 1e-2 * spread}).fun)


def _usual(effect: DriveEffect) -> bool:
    return isinstance(effect, CurrentBandwidth) and effect.bandwidth > SLOW * USUAL_BANDWIDTHS[0]


def _as_commissioned() -> list[tuple[DriveEffect, ...]]:
    """What a sound drive may be: as recorded, or any usual current loop, which no recording tells to a fraction of a sample."""
    return [(), *((CurrentBandwidth(bandwidth),) for bandwidth in USUAL_BANDWIDTHS)]
