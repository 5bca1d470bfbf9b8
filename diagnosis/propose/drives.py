"""Effects between the torque that a drive's loops ask for and the torque that it gives: seen without the plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from diagnosis.prepare.drive_law import Asked, asked_of
from diagnosis.prepare.motion import Run
from emulator.effects import DriveEffect, Effect
from emulator.effects.current_bandwidth import CurrentBandwidth

Array = NDArray[np.float64]

USUAL_BANDWIDTHS = (200.0, 300.0, 450.0, 700.0, 1000.0)
"""Of a sound servo drive's current loop [Hz]."""
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
        """Nats that it brings: rows ten of which count as one, less half the logarithm of their number."""
        count = max(self.rows / 10.0, 2.0)
        return 0.5 * count * float(np.log(max(self.without, 1e-300) / max(self.left, 1e-300))) - 0.5 * float(np.log(count))


def drive_effects(runs: Sequence[Run], axis: str, kinds: Sequence[type[Effect]]) -> list[DriveFound]:
    """The best of each effect on an axis whose law holds."""
    known = [(run, asked) for run in runs if (asked := asked_of(run, axis)) is not None and run.axes[axis].used.any()]
    if not known:
        return []
    without, count = min(_left(known, axis, usual) for usual in _as_commissioned())
    found = []
    for kind in kinds:
        if issubclass(kind, DriveEffect):
            tried = [
                effect for run, asked in known for effect in kind.candidates(asked.lagged, run.smooth(asked.given), run.period)
            ]
            if kind is CurrentBandwidth:
                tried = [effect for effect in tried if _value(effect) < SLOW * USUAL_BANDWIDTHS[0]]
            if tried:
                best = min(tried, key=lambda effect: _left(known, axis, effect)[0])
                best = _moved(known, axis, best)
                found.append(DriveFound(axis, best, without, _left(known, axis, best)[0], count))
    return found


def _as_commissioned() -> list[DriveEffect | None]:
    """What a sound drive may be: as recorded, or any usual current loop, which no recording tells to a fraction of a sample."""
    return [None, *(CurrentBandwidth(bandwidth) for bandwidth in USUAL_BANDWIDTHS)]


def given_with(asked: Asked, effect: DriveEffect, period: float) -> Array:
    """Torque that the law and the effect give; a bandwidth takes the place of the commissioned lag."""
    return effect.respond(asked.fast if isinstance(effect, CurrentBandwidth) else asked.lagged, period)


def _left(known: Sequence[tuple[Run, Asked]], axis: str, effect: DriveEffect | None) -> tuple[float, int]:
    """Mean square of given less predicted after what timing and the unknown state of the integral may be: 1, t, q, v, a."""
    total, rows = 0.0, 0
    for run, asked in known:
        predicted = asked.lagged if effect is None else given_with(asked, effect, run.period)
        own = run.axes[axis]
        pick = np.flatnonzero(own.used[:: run.stride]) * run.stride
        if len(pick) < 20:
            continue
        y = run.smooth(asked.given - predicted)[pick]
        motion = own.motion
        samples = (motion.time, motion.position, motion.velocity, motion.acceleration)
        free = np.column_stack([np.ones(len(y)), *(values[pick] for values in samples)])
        free = (free - free.mean(axis=0) * (np.arange(5) > 0)) / np.maximum(np.abs(free).max(axis=0), 1e-12)
        coefficients = np.linalg.lstsq(free, y, rcond=None)[0]
        total += float(np.sum((y - free @ coefficients) ** 2))
        rows += len(y)
    return (total / rows if rows else 0.0), rows


def _value(effect: DriveEffect) -> float:
    """Of the one parameter that such an effect has."""
    return float(getattr(effect, type(effect).parameters[0].name))


def _moved(known: Sequence[tuple[Run, Asked]], axis: str, effect: DriveEffect) -> DriveEffect:
    """The one parameter moved to where least is left, a little to either side."""
    name, value = type(effect).parameters[0].name, _value(effect)

    def left(logarithm: float) -> float:
        return _left(known, axis, replace(effect, **{name: float(np.exp(logarithm))}))[0]

    solved = minimize_scalar(left, bounds=(np.log(value / 1.6), np.log(value * 1.3)), method="bounded", options={"xatol": 2e-3})
    bounds = type(effect).parameters[0]
    return replace(effect, **{name: float(np.clip(np.exp(solved.x), bounds.low, bounds.high))})
