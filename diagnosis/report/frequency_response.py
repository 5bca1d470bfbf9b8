"""Velocity of an axis over its torque by frequency, from recordings: what tells a stiff axis from an elastic one.

The drive's loops answer every disturbance with a torque, so in a closed loop velocity over torque is in part the loops' own.
What drove the axis, a torque that was added or the demand, is not. Torque and velocity are therefore each compared with that
(H1, Welch 1967), and the ratio of both is the mechanics (Pintelon and Schoukens, System Identification, 2012, 2.6).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from drivetwin.diagnosis.prepare.channel import delay_of
from drivetwin.diagnosis.report.result import Array, Diagnosis, FrequencyResponse, Mask, NoResponse
from drivetwin.identification.frequency.resonances import resonances_of
from drivetwin.recording.recording import TORQUE, Recording

INSTRUMENTS = ("torque_offset", "position_demand", "velocity_demand")
"""What may have driven an axis, the best first: a torque excites what a demand is too slow for."""

WINDOWS = (2.0, 1.0, 0.5)
"""Of a spectrum [s]; the longest of which there are enough."""

FEWEST_WINDOWS = 10

FEWEST_LINES = 10
"""Reliable ones that make a curve."""

SURE = 0.05
"""Relative standard deviation up to which a line is reliable: 0.43 dB and 2.9 degrees, far below the 3 dB of a resonance."""

OVERLAP = 1.056
"""Windows of Hann that overlap by half, an independent one: 1 + 2 / 6² (Welch 1967)."""

HIGHEST = 0.4
"""Of the sample rate."""

MOSTLY, HARDLY = 0.5, 0.02
"""Share of a window in which an axis moves, from which it is in motion, and up to which it stands."""

SMOOTHED = 0.02
"""Over which a velocity is averaged before it counts as motion [s]: an encoder's counts are none."""

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class _Signals:
    """What drives an axis, its torque and its velocity over one recording, (n,) each; when it and others move."""

    instrument: Array
    torque: Array
    velocity: Array
    moves: Mask
    others: Mask


def with_responses(found: Diagnosis, recordings: Sequence[Recording]) -> Diagnosis:
    """The diagnosis with the frequency response of every axis, from all recordings, fitted or not."""
    standstill = {axis: gap.standstill_velocity for axis, gap in found.axes.items()}
    responses = {axis: frequency_response(recordings, axis, standstill) for axis in found.axes}
    return replace(found, responses=responses)


def frequency_response(
    recordings: Sequence[Recording], axis: str, standstill: dict[str, float]
) -> FrequencyResponse | NoResponse:
    """Of one axis, where it moves and no other does; `standstill` [rad/s or m/s] by axis: what counts as no motion."""
    with_torque = [each for each in recordings if TORQUE in each.columns.get(axis, {})]
    if not with_torque:
        return NoResponse("its torque was not recorded")
    instrument = next((name for name in INSTRUMENTS if any(_varies(each, axis, name) for each in with_torque)), None)
    if instrument is None:
        return NoResponse(
            "no demand was recorded (position_demand, velocity_demand or torque_offset), so that its mechanics "
            "cannot be told from what its own loops do"
        )
    driven = [each for each in with_torque if _varies(each, axis, instrument)]
    periods = Counter(each.info.sample_period for each in driven for _ in range(len(each.time)))
    period = periods.most_common(1)[0][0]
    signals = [_signals(each, axis, instrument, standstill) for each in driven if each.info.sample_period == period]
    late = delay_of(driven[0].info.axes[axis])
    for seconds in WINDOWS:
        spectra = _spectra(signals, round(seconds / period))
        if len(spectra) >= FEWEST_WINDOWS:
            return _told(spectra, instrument, period, seconds, late)
    alone = " while the others stand" if len(standstill) > 1 else ""
    return NoResponse(f"it moves{alone} in {len(spectra)} windows of {WINDOWS[-1]:g} s; {FEWEST_WINDOWS} are needed")


def _varies(recording: Recording, axis: str, name: str) -> bool:
    values = recording.columns.get(axis, {}).get(name)
    return values is not None and bool(np.isfinite(values).all()) and bool(np.ptp(values) > 0.0)


def _signals(recording: Recording, axis: str, instrument: str, standstill: dict[str, float]) -> _Signals:
    """Inner samples (n - 2,): differences of positions are central ones."""
    period, own = recording.info.sample_period, recording.columns[axis]
    drives = own[instrument]
    others = [_moves(_velocity(columns, period), period, standstill[name])
              for name, columns in recording.columns.items() if name != axis and name in standstill]  # fmt: skip
    velocity = _velocity(own, period)
    return _Signals(
        _central(drives, period) if instrument == "position_demand" else drives[1:-1],
        own[TORQUE][1:-1],
        velocity,
        _moves(velocity, period, standstill[axis]),
        np.asarray(np.any(others, axis=0) if others else np.zeros(len(velocity), dtype=np.bool_)),
    )


def _velocity(columns: dict[str, Array], period: float) -> Array:
    return _central(columns["position"], period) if "position" in columns else columns["velocity"][1:-1]


def _central(position: Array, period: float) -> Array:
    return np.asarray((position[2:] - position[:-2]) / (2.0 * period))


def _moves(velocity: Array, period: float, standstill: float) -> Mask:
    return np.asarray(np.abs(ndimage.uniform_filter1d(velocity, max(1, round(SMOOTHED / period)))) > standstill)


def _spectra(signals: Sequence[_Signals], length: int) -> Complex:
    """Of instrument, torque and velocity in each window (windows, 3, length // 2 + 1), half of which the next one shares."""
    window = signal.windows.hann(length, sym=False)
    rows = [
        np.fft.rfft(signal.detrend(np.stack([each.instrument[part], each.torque[part], each.velocity[part]])) * window)
        for each in signals
        for part in _parts(each, length)
    ]
    return np.array(rows, dtype=np.complex128).reshape(len(rows), 3, length // 2 + 1)


def _parts(signals: _Signals, length: int) -> Iterator[slice]:
    for start in range(0, len(signals.velocity) - length + 1, length // 2):
        part = slice(start, start + length)
        if signals.moves[part].mean() >= MOSTLY and signals.others[part].mean() <= HARDLY:
            yield part


def _told(spectra: Complex, instrument: str, period: float, seconds: float, late: float) -> FrequencyResponse | NoResponse:
    """Response and coherence from the windows' spectra (windows, 3, lines)."""
    frequency = np.arange(spectra.shape[2]) / (spectra.shape[2] - 1) / (2.0 * period)
    shown = (frequency > 0.0) & (frequency <= HIGHEST / period)
    frequency, drives, torque, velocity = frequency[shown], *(spectra[:, part, shown] for part in range(3))
    angle = 2.0 * np.pi * frequency * period
    ratio = _crossed(velocity, drives) / _crossed(torque, drives) * angle / np.sin(angle)
    ratio = ratio * np.exp(-2j * np.pi * frequency * late)
    coherence = np.stack([_coherence(each, drives) for each in (torque, velocity)])
    windows = len(spectra)
    deviation = np.sqrt(((1.0 - coherence) / coherence).sum(axis=0) * OVERLAP / (2.0 * windows))
    sure = deviation <= SURE
    worse = coherence.min(axis=0)
    if sure.sum() < FEWEST_LINES:
        return NoResponse(
            f"torque and velocity follow the {instrument.replace('_', ' ')} reliably at {int(sure.sum())} of {len(sure)} "
            f"frequencies, and {FEWEST_LINES} are needed: the motion excites too few; drivetwin bode excites more"
        )
    shapes = resonances_of(frequency[sure], ratio[sure])
    return FrequencyResponse(instrument, frequency, ratio, worse, np.asarray(sure), windows, seconds, shapes)


def _crossed(answer: Complex, drives: Complex) -> Complex:
    return np.asarray((answer * drives.conj()).sum(axis=0))


def _coherence(answer: Complex, drives: Complex) -> Array:
    both = (np.abs(answer) ** 2).sum(axis=0) * (np.abs(drives) ** 2).sum(axis=0)
    return np.asarray(np.clip(np.abs(_crossed(answer, drives)) ** 2 / np.maximum(both, 1e-300), 1e-12, 1.0))
