"""How the gap of an axis varies over position, load, time, frequency, other axes: hints that need no model of a cause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import signal

from drivetwin.diagnosis.report.cross_validation import FOLDS, Folds, fit, hats
from drivetwin.diagnosis.report.gap_test import NOISE_KNOWN_TO
from drivetwin.diagnosis.report.result import Array, AxisPrediction, Pattern, Prediction

SMALLEST_SHARE = 0.02
_RATE = 4.0
"""Samples kept a period of the cut-off: what the filter leaves, with room."""
_BLOCK = 1.0
"""Least length [s] of the stretches that are fitted or held out."""
_STRETCHES = 50
_SPEED_KNOTS, _POSITION_KNOTS, _TIME_KNOTS = 6, 12, 6
_BINS = 8192
"""Of the position, in which a periodic gap is looked for; the shortest period that can be named is four of them."""
_LEAST_PERIODS = 2.0
_PEAK_OVER_AROUND = 6.0
_PEAK_OCTAVE = 2.0**0.5
_LOWEST_FREQUENCY = 2.0


@dataclass(frozen=True)
class _Series:
    """One axis in motion over all recordings, thinned, (n,) each; `time` [s] runs on from one recording to the next."""

    time: Array
    gap: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    others: dict[str, Array]

    @cached_property
    def direction(self) -> Array:
        return np.sign(self.velocity)

    @cached_property
    def folds(self) -> Folds:
        length = max(_BLOCK, float(self.time[-1] - self.time[0]) / _STRETCHES)
        return Folds((self.time / length).astype(np.intp) % FOLDS)

    @cached_property
    def own(self) -> Array:
        """What goes with the axis's own direction, speed and acceleration, (n, p)."""
        speed = np.log(np.abs(self.velocity))
        knots = np.linspace(float(np.percentile(speed, 2.0)), float(np.percentile(speed, 98.0)), _SPEED_KNOTS)
        at_speed = hats(speed, knots)
        forwards = (self.direction > 0.0)[:, None]
        return np.column_stack([at_speed * forwards, at_speed * ~forwards, self.acceleration])

    @cached_property
    def rest(self) -> Array:
        """The gap (n,) less what goes with the axis's own motion."""
        return self.beyond_own(self.gap)

    def beyond_own(self, columns: Array) -> Array:
        """`columns` (n,) or (n, p) less what of them goes with the axis's own motion."""
        return np.asarray(columns - self.own @ fit(self.own, columns))

    def explained(self, columns: Array) -> float:
        """Energy of the gap that goes with `columns` (n, p) and not with the axis's own motion."""
        return self.folds.explained(self.beyond_own(columns), self.rest)


def patterns(
    predictions: Sequence[Prediction], axis: str, noise_rms: float, cutoff_hz: float, unit: str
) -> tuple[Pattern, ...]:
    """Shares above 0.02 of the gap's energy above noise that go with one quantity, largest first; contract, "patterns".

    What goes with speed, direction and acceleration of the axis itself is taken off first (`where` tells of it): a pattern
    is what a quantity explains beyond them, by least squares cross-validated over stretches of at least a second:
    `position`, the strongest period over position (a periodogram over position, Lomb 1976, with and without the sign of the
    velocity) or a curve over position, whichever is more; `load`, the simulated torque, and its magnitude against the motion;
    `time`, a level of the gap or of its friction that changes slowly; `frequency`, a peak of the power spectrum above what is
    around it; `cross_axis`, the motion or torque of another axis. `noise_rms` is in `unit`, "N·m" or "N", which also says
    whether positions are angles. None where the gap is no larger than noise.
    """
    series = _series(predictions, axis, cutoff_hz)
    if len(series.gap) < _STRETCHES:
        return ()
    whole = float(series.gap @ series.gap)
    energy = whole - noise_rms**2 * len(series.gap)
    if whole <= ((1.0 + NOISE_KNOWN_TO) * noise_rms) ** 2 * len(series.gap):
        return ()
    found = (
        *_over_position(series, unit == "N"),
        *_over_load(series),
        *_over_time(series),
        *_over_frequency(predictions, axis, series, cutoff_hz),
        *_over_other_axes(series),
    )
    shares = (Pattern(each.over, min(1.0, each.share / energy), each.detail) for each in found)
    return tuple(sorted((each for each in shares if each.share > SMALLEST_SHARE), key=lambda each: -each.share))


def _series(predictions: Sequence[Prediction], axis: str, cutoff_hz: float) -> _Series:
    """The samples in motion of all recordings, as many a second from each."""
    interval = 1.0 / (_RATE * cutoff_hz)
    begin, parts = 0.0, []
    for prediction in predictions:
        stride = max(1, round(interval / prediction.period))
        chosen = np.flatnonzero(prediction.axes[axis].used[::stride]) * stride
        parts.append((begin, prediction, chosen))
        begin += prediction.period * len(prediction.time)

    def joined(name: str, of: str = axis) -> Array:
        return np.concatenate([getattr(prediction.axes[of], name)[chosen] for _, prediction, chosen in parts])

    others = [other for other in predictions[0].axes if other != axis]
    quantities = {"acceleration": "acceleration", "velocity": "velocity", "torque": "before"}
    return _Series(
        time=np.concatenate([start + run.time[chosen] - run.time[0] for start, run, chosen in parts]),
        gap=joined("measured") - joined("before"),
        position=joined("position"),
        velocity=joined("velocity"),
        acceleration=joined("acceleration"),
        torque=joined("before"),
        others={f"{word} of {other}": joined(name, other) for other in others for word, name in quantities.items()},
    )


def _over_position(series: _Series, slides: bool) -> Iterator[Pattern]:
    """The better of a period and a curve over position."""
    low, high = float(series.position.min()), float(series.position.max())
    if high <= low:
        return
    periodic = 0.0
    for fold in range(FOLDS):
        train = series.folds.of_sample != fold
        if train.any() and not train.all():
            period = _strongest_period(series.position[train], series.rest[train], series.direction[train])
            periodic += series.folds.explained_in(fold, series.beyond_own(_waves(series, period)), series.rest)
    curve = hats(series.position, np.linspace(low, high, _POSITION_KNOTS))
    bent = series.explained(np.column_stack([curve, curve * series.direction[:, None]]))
    word, scale = ("mm", 1e3) if slides else ("deg", 180.0 / np.pi)
    if periodic >= bent:
        period = _strongest_period(series.position, series.rest, series.direction)
        yield Pattern("position", periodic, f"period {scale * period:.3g} {word}")
    else:
        shape = curve @ fit(curve, series.rest)
        most = scale * series.position[int(np.argmax(np.abs(shape)))]
        travel = f"{scale * (high - low):.3g} {word}"
        yield Pattern("position", bent, f"a curve over {travel} of travel, largest at {most:.3g} {word}")


def _waves(series: _Series, period: float) -> Array:
    phase = 2.0 * np.pi * series.position / period
    waves = np.column_stack([np.sin(phase), np.cos(phase)])
    return np.column_stack([waves, waves * series.direction[:, None]])


def _strongest_period(position: Array, gap: Array, direction: Array) -> float:
    """Period [rad or m] over position, of the gap or of the gap against the motion, whose amplitude is the largest.

    Samples are binned over position, so that sums of gap times exp(-2 pi i q/period) are a Fourier transform of the bins.
    """
    low, travel = float(position.min()), float(np.ptp(position))
    at = np.minimum(((position - low) / travel * _BINS).astype(np.intp), _BINS - 1)
    padded = 4 * _BINS
    power = np.zeros(padded // 2 + 1)
    for values in (gap, gap * direction):
        power += np.abs(np.fft.rfft(np.bincount(at, values, _BINS), padded)) ** 2
    waves = np.arange(len(power)) / 4.0
    power[(waves < _LEAST_PERIODS) | (waves > _BINS / 4.0)] = 0.0
    return travel / float(_summit(waves, power))


def _summit(x: Array, y: Array) -> float:
    """Where a parabola through the largest of `y` and its neighbours is highest."""
    k = int(np.clip(np.argmax(y), 1, len(y) - 2))
    bend = y[k - 1] - 2.0 * y[k] + y[k + 1]
    return float(x[k] + (0.5 * (y[k - 1] - y[k + 1]) / bend * (x[k + 1] - x[k]) if bend < 0.0 else 0.0))


def _over_load(series: _Series) -> Iterator[Pattern]:
    """With the torque that the simulation expects; the measured one has the gap in it."""
    both = np.column_stack([np.abs(series.torque) * series.direction, series.torque])
    friction, along = (series.explained(column[:, None]) for column in both.T)
    slopes = fit(series.beyond_own(both), series.rest)
    if friction >= along:
        detail = f"friction {'grows' if slopes[0] > 0.0 else 'falls'} with |torque|"
    else:
        detail = f"{'grows' if slopes[1] > 0.0 else 'falls'} with torque"
    yield Pattern("load", series.explained(both), detail)


def _over_time(series: _Series) -> Iterator[Pattern]:
    """An offset, a friction or a viscosity that changes slowly."""
    level = hats(series.time, np.linspace(series.time[0], series.time[-1], _TIME_KNOTS))
    columns = np.column_stack([level, level * series.direction[:, None], level * series.velocity[:, None]])
    explained = series.explained(columns)
    seconds = float(series.time[-1] - series.time[0])
    third = seconds / 3.0
    first = float(np.sqrt(np.mean(series.gap[series.time <= series.time[0] + third] ** 2)))
    last = float(np.sqrt(np.mean(series.gap[series.time >= series.time[-1] - third] ** 2)))
    change = f"falls by {1.0 - last / first:.0%}" if last < first else f"grows by {last / first - 1.0:.0%}"
    yield Pattern("time", explained, f"{change} in {seconds:.0f} s".replace("%", " %"))


def _over_frequency(predictions: Sequence[Prediction], axis: str, series: _Series, cutoff_hz: float) -> Iterator[Pattern]:
    """A peak of the spectrum of what the axis's own motion leaves, less the level around it."""
    frequency, density = _spectrum(predictions, axis, cutoff_hz)
    band = (frequency >= _LOWEST_FREQUENCY) & (frequency <= cutoff_hz)
    if band.sum() < 8:
        return
    peak = int(np.flatnonzero(band)[np.argmax(density[band])])
    octave = band & (frequency > frequency[peak] / _PEAK_OCTAVE) & (frequency < frequency[peak] * _PEAK_OCTAVE)
    around = float(np.median(density[octave]))
    if density[peak] < _PEAK_OVER_AROUND * around:
        return
    near = octave & (np.abs(frequency - frequency[peak]) <= max(1.0, 0.1 * frequency[peak]))
    excess = float(np.sum(np.maximum(density[near] - around, 0.0)) * (frequency[1] - frequency[0]))
    yield Pattern("frequency", excess * len(series.gap), f"{frequency[peak]:.3g} Hz")


def _spectrum(predictions: Sequence[Prediction], axis: str, cutoff_hz: float) -> tuple[Array, Array]:
    """Frequency [Hz] and one-sided density [(N·m)²/Hz] of the gap in motion, its own-motion part taken off; by Welch 1967."""
    interval = 1.0 / (_RATE * cutoff_hz)
    total, weight, frequency = np.zeros(0), 0.0, np.zeros(0)
    for prediction in predictions:
        stride = max(1, round(interval / prediction.period))
        rest = _rest_over_time(prediction.axes[axis])[::stride]
        rate = 1.0 / (stride * prediction.period)
        length = round(2.0 * rate)
        moving = float(np.mean(prediction.axes[axis].used))
        if len(rest) < length or moving == 0.0:
            continue
        found, density = signal.welch(rest, fs=rate, nperseg=length)
        frequency = np.asarray(found) if not frequency.size else frequency
        total = np.interp(frequency, found, density / moving) * len(rest) / rate + (total if total.size else 0.0)
        weight += len(rest) / rate
    return frequency, total / weight if weight else total


def _rest_over_time(axis: AxisPrediction) -> Array:
    """What `_Series.rest` is, for every sample (n,) of a recording; 0 at rest."""
    rest = np.zeros(len(axis.measured))
    used = axis.used
    if used.sum() < _STRETCHES:
        return rest
    empty = np.zeros(0)
    gap = (axis.measured - axis.before)[used]
    rest[used] = _Series(empty, gap, axis.position[used], axis.velocity[used], axis.acceleration[used], empty, {}).rest
    return rest


def _over_other_axes(series: _Series) -> Iterator[Pattern]:
    """The one quantity of another axis that explains most."""
    if series.others:
        gains = {words: series.explained(values[:, None]) for words, values in series.others.items()}
        best = max(gains, key=lambda words: gains[words])
        yield Pattern("cross_axis", gains[best], f"with {best}")
