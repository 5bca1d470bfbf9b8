"""The real encoder: the eccentricity of its disc on the shaft, and the delay of its reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sin

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.place import Place
from drivetwin.emulator.dynamics.records import records
from drivetwin.foundation.compiled import compiled


@dataclass(frozen=True)
class Encoder:
    """Reading = angle + gear eccentricity sin(angle + phase), `delay` [s] ago; angle of the motor [rad].

    `eccentricity` is on the joint side [rad or m].
    """

    eccentricity: float = 0.0
    phase: float = 0.0
    delay: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether it reads anything else than the angle now."""
        return self.eccentricity != 0.0 or self.delay > 0.0


@compiled
def _read(encoders, delays, history, newest, angle, reading) -> None:  # type: ignore[no-untyped-def]
    """Readings (n,) of angles (n,), `delays` (rows,) periods late, through the rings `history` (rows, length)."""
    reading[:] = angle
    length = history.shape[1]
    for row in range(encoders.shape[0]):
        encoder = encoders[row]
        history[row, newest] = _seen(encoder, angle[encoder.axis])
        whole = int(delays[row])
        share = delays[row] - whole
        later, earlier = history[row, (newest - whole) % length], history[row, (newest - whole - 1) % length]
        reading[encoder.axis] = later + share * (earlier - later)


@compiled
def _seen(encoder, angle):  # type: ignore[no-untyped-def]
    return angle + encoder.gear * encoder.eccentricity * sin(angle + encoder.phase)


class Encoders:
    """The encoders that read anything else than the motor's angle now, at every `period` [s]."""

    def __init__(
        self,
        encoders: Sequence[tuple[Encoder, Place]],
        period: float,
        motor_angle: NDArray[np.float64],
        motor_position: NDArray[np.float64],
    ) -> None:
        self._encoders = records(encoders)
        self._delays = np.asarray(self._encoders["delay"] / period)
        length = int(self._delays.max()) + 2
        standing = [_seen(row, motor_angle[row["axis"]]) for row in self._encoders]
        self._history = np.repeat(np.array(standing)[:, None], length, axis=1)
        self._newest = 0
        self._arrays = (motor_angle, motor_position)

    def read(self) -> None:
        """Turn the motor angles into what the drives are told."""
        self._newest = (self._newest + 1) % self._history.shape[1]
        _read(self._encoders, self._delays, self._history, self._newest, *self._arrays)
