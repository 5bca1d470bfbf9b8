"""Phasors of the lines in each excited period, and what the periods have in common: response and coherence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.errors import UserError
from drivetwin.identification.frequency.wave import Wave
from drivetwin.recording.recording import Recording, Samples

Complex = NDArray[np.complex128]

COLUMNS = ("torque", "position", "torque_offset")


@dataclass(frozen=True)
class Excited:
    """A recording in which `axis` was excited: whole periods of `wave` begin at the samples `starts`, in its steady state.

    After `repeats` of them the axis is at the same place again, moving the same way.
    """

    recording: Recording
    axis: str
    wave: Wave
    starts: Sequence[int]
    repeats: int


@dataclass(frozen=True)
class Response:
    """What answers to the injected torque (m,): `frequency` [Hz], phasors of torque [1] and position [rad/N·m or m/N] for a
    unit of it, and the coherence of each with it, 0..1.

    `deviation` is the standard deviation of the responses' ratio, relative: 0.01 is 0.09 dB and 0.6 degrees.
    """

    frequency: Samples
    torque: Complex
    position: Complex
    torque_coherence: Samples
    position_coherence: Samples
    deviation: Samples

    @property
    def coherence(self) -> Samples:
        """The worse of both (m,)."""
        return np.minimum(self.torque_coherence, self.position_coherence)


def response(excited: Excited) -> Response:
    """H1 estimates over the periods (Bendat and Piersol, Random Data, 2010, ch. 6).

    The injected torque is known exactly, and no noise of loop or sensors is in it: in a closed loop the ratio of two such
    responses is unbiased, that of the measured signals is not (Pintelon and Schoukens 2012, 2.6).
    Raises UserError for fewer than two periods, which have no coherence, or a missing column.
    """
    if len(excited.starts) < 2:
        raise UserError(f"{excited.recording.name}: {len(excited.starts)} excited periods; a coherence needs at least two")
    columns = excited.recording.columns[excited.axis]
    if missing := [name for name in COLUMNS if name not in columns]:
        raise UserError(f"{excited.recording.name}: axis {excited.axis} has no {missing[0]}, and a frequency response needs it")
    torque, position, injected = (_phasors(columns[name], excited) for name in COLUMNS)
    length = len(excited.wave.samples)
    return Response(
        excited.wave.lines / (length * excited.recording.info.sample_period),
        _ratio(torque, injected),
        _ratio(position, injected),
        _coherence(torque, injected),
        _coherence(position, injected),
        np.hypot(_deviation(torque, injected, excited.repeats), _deviation(position, injected, excited.repeats)),
    )


def _phasors(values: Samples, excited: Excited) -> Complex:
    """Of each period and line (periods, m), by least squares beside a straight line: the axis travels meanwhile."""
    length, lines = len(excited.wave.samples), excited.wave.lines
    angle = 2.0 * np.pi * np.outer(np.arange(length) / length, lines)
    straight = np.column_stack([np.ones(length), np.linspace(-1.0, 1.0, length)])
    basis = np.column_stack([straight, np.cos(angle), -np.sin(angle)])
    periods = np.column_stack([values[start : start + length] for start in excited.starts])
    found = np.linalg.lstsq(basis, periods - periods.mean(axis=0), rcond=None)[0][2:]
    return np.asarray((found[: len(lines)] + 1j * found[len(lines) :]).T)


def _ratio(answer: Complex, injected: Complex) -> Complex:
    return np.asarray((answer * injected.conj()).sum(axis=0) / (np.abs(injected) ** 2).sum(axis=0))


def _coherence(answer: Complex, injected: Complex) -> Samples:
    both = np.abs((answer * injected.conj()).sum(axis=0)) ** 2
    return np.asarray(both / ((np.abs(answer) ** 2).sum(axis=0) * (np.abs(injected) ** 2).sum(axis=0)))


def _deviation(answer: Complex, injected: Complex, repeats: int) -> Samples:
    """Relative standard deviation of the mean response in gain or phase (m,), by how much periods at the same place differ.

    An inertia that depends on the place is no noise: it lowers the coherence, and the response is the mean over the way.
    """
    ratio, count = answer / injected, len(answer)
    groups = [ratio[first::repeats] for first in range(repeats)] if count >= 2 * repeats else [ratio]
    apart = sum((np.abs(group - group.mean(axis=0)) ** 2).sum(axis=0) for group in groups)
    variance = np.asarray(apart) / (count - len(groups))
    return np.asarray(np.sqrt(variance / (2.0 * count)) / np.abs(_ratio(answer, injected)))
