"""Effects between the torque that a drive's loops ask for and the torque that it gives: seen without the plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from drivetwin.diagnosis.prepare.drive_law import Asked, drive_candidates, known_laws, law_holds, left_by
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.propose.nominal import timing_error
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import DriveEffect, Effect
from drivetwin.emulator.effects.current_bandwidth import CurrentBandwidth

USUAL_BANDWIDTHS = (200.0, 300.0, 450.0, 700.0, 1000.0)
"""Of a sound servo drive's current loop [Hz]."""
LATEST = 6.0
"""Deviations of the timing, up to which another time to read the torque is sought."""
SLOW = 0.8
"""Share of the least usual bandwidth below which a current loop is slow."""


@dataclass(frozen=True)
class DriveFound:
    """An effect of one axis's drive: mean square that the law leaves without it and with it, over `rows`."""

    axis: str
    effect: DriveEffect
    without: float
    left: float
    rows: int

    @property
    def gain(self) -> float:
        """Nats that its one parameter brings."""
        return _nats(self.without, self.left, self.rows)


def drive_effects(runs: Sequence[Run], axis: str, kinds: Sequence[type[Effect]], settings: Settings) -> list[DriveFound]:
    """The best effect on an axis whose law holds, and after it the best of the others beside those that were found.

    It has to take a least share of what the law alone leaves. With it the law has to give the recorded torque: otherwise, at
    one constant speed, a limit far below the torque would fit as well. One that does not is asked again beside the next: a
    limit behind a slow current loop. A slow loop is not reported where a torque that is recorded late is more probable: motion
    alone does not show that where an unknown torque hides it.
    """
    known = known_laws(runs, axis)
    tried = [effect for effect in (drive_candidates(known) if known else []) if type(effect) in kinds and not _usual(effect)]
    found: list[DriveFound] = []
    whole, count = min(_left(known, axis, usual) for usual in _as_commissioned()) if tried else (0.0, 0)
    without, refused = whole, list[DriveEffect]()
    while open_ones := [effect for effect in tried if all(effect is not one for one in refused)]:
        beside = tuple(one.effect for one in found)
        begun = min(open_ones, key=lambda effect: _left(known, axis, (*beside, effect))[0])
        best = _moved(known, axis, begun, beside)
        left = _left(known, axis, (*beside, best))[0]
        if without - left < settings.least_share * whole:
            break
        one = DriveFound(axis, best, without, left, count)
        if not law_holds(known, axis, (*beside, best)):
            refused.append(begun)
            continue
        if isinstance(best, CurrentBandwidth) and _gain_of_reading(runs, beside, one, settings) >= one.gain:
            refused += [effect for effect in tried if isinstance(effect, CurrentBandwidth)]
            continue
        found.append(one)
        without, refused = left, []
        tried = [effect for effect in tried if type(effect) is not type(best)]
    return found


def _nats(without: float, left: float, rows: int) -> float:
    """Log evidence of one parameter by mean squares: ten rows count as one; half the logarithm of their number it costs."""
    count = max(rows / 10.0, 2.0)
    return 0.5 * count * float(np.log(max(without, 1e-300) / max(left, 1e-300))) - 0.5 * float(np.log(count))


def _gain_of_reading(runs: Sequence[Run], beside: Sequence[DriveEffect], one: DriveFound, settings: Settings) -> float:
    """Nats that it brings instead of an effect to read the torque at another time than by the motion, less what that costs."""
    spread = timing_error(runs, settings)

    def lost(shift: float) -> float:
        left, rows = _left(known_laws([run.aligned({one.axis: shift}) for run in runs], one.axis), one.axis, beside)
        return 0.5 * (shift / spread) ** 2 - _nats(one.without, left, rows)

    most = LATEST * spread
    return -float(minimize_scalar(lost, bounds=(-most, most), method="bounded", options={"xatol": 1e-2 * spread}).fun)


def _usual(effect: DriveEffect) -> bool:
    return isinstance(effect, CurrentBandwidth) and effect.bandwidth > SLOW * USUAL_BANDWIDTHS[0]


def _as_commissioned() -> list[tuple[DriveEffect, ...]]:
    """What a sound drive may be: as recorded, or any usual current loop, which no recording tells to a fraction of a sample."""
    return [(), *((CurrentBandwidth(bandwidth),) for bandwidth in USUAL_BANDWIDTHS)]


def _left(known: Sequence[tuple[Run, Asked]], axis: str, effects: Sequence[DriveEffect]) -> tuple[float, int]:
    """Mean square of what the law and effects leave, and its rows."""
    rows = np.concatenate([left_by(run, axis, asked, effects) for run, asked in known])
    return (float(np.mean(rows**2)) if len(rows) else 0.0), len(rows)


def _value(effect: DriveEffect) -> float:
    """Of the one parameter that such an effect has."""
    return float(getattr(effect, type(effect).parameters[0].name))


def _moved(known: Sequence[tuple[Run, Asked]], axis: str, effect: DriveEffect, beside: Sequence[DriveEffect]) -> DriveEffect:
    """The one parameter moved to where least is left, a little to either side."""
    name, value = type(effect).parameters[0].name, _value(effect)

    def left(logarithm: float) -> float:
        return _left(known, axis, (*beside, replace(effect, **{name: float(np.exp(logarithm))})))[0]

    solved = minimize_scalar(left, bounds=(np.log(value / 1.6), np.log(value * 1.3)), method="bounded", options={"xatol": 2e-3})
    bounds = type(effect).parameters[0]
    return replace(effect, **{name: float(np.clip(np.exp(solved.x), bounds.low, bounds.high))})
