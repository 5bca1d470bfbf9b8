"""Touch probe: positions latched at the edges of an input (CiA 402-2, clause 'Touch probe'): 60B8h..60BDh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.objects import optional

ENABLE, CONTINUOUS, ZERO_IMPULSE, POSITIVE, NEGATIVE = 1 << 0, 1 << 1, 1 << 2, 1 << 4, 1 << 5
"""Bits of 60B8h; those of touch probe 2 are 8 further."""
SOURCE = 3 << 2
"""What triggers it: two bits."""
ENABLED, POSITIVE_STORED, NEGATIVE_STORED = 1 << 0, 1 << 1, 1 << 2
"""Bits of 60B9h, likewise."""


@dataclass
class _Probe:
    """One of the two. `status` are its bits of 60B9h, `level` the input as last seen."""

    number: int
    positive: int
    negative: int
    status: int = 0
    level: bool = False


class TouchProbe:
    """Both probes. The input is read every servo period, and the position is that of the period after the edge."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._function = optional(axis.dictionary, 0x60B8)
        self._probes = (_Probe(0, 0x60BA, 0x60BB), _Probe(1, 0x60BC, 0x60BD))
        self._before = 0.0
        if self._function is not None:
            self._function.on_write = _check_sources
            axis.dictionary[0x60B9].on_read = self._status

    def reset(self) -> None:
        """As after power-on."""
        for probe in self._probes:
            probe.status = 0

    def after(self) -> None:
        """Look at the cycle that has passed."""
        function = 0 if self._function is None else int(self._function.value)
        first, second = self._probes
        if not (function or first.status or second.status):
            return
        path = np.concatenate([[self._before], self._axis.servo.positions])
        for probe in self._probes:
            self._look(probe, function >> 8 * probe.number & 0xFF, path)
        self._before = float(path[-1])

    def _look(self, probe: _Probe, function: int, path: NDArray[np.float64]) -> None:
        if not function & ENABLE:
            probe.status = 0
            return
        if not probe.status & ENABLED:  # from now on: what came before is no edge
            probe.status = ENABLED
            probe.level = self._level(probe, float(path[-1]))
            return
        rising, falling = self._edges(probe, function, path)
        for edges, wanted, stored, index in (
            (rising, POSITIVE, POSITIVE_STORED, probe.positive),
            (falling, NEGATIVE, NEGATIVE_STORED, probe.negative),
        ):
            first_only = not function & CONTINUOUS
            if not function & wanted or not edges.any() or (first_only and probe.status & stored):
                continue
            period = int(np.flatnonzero(edges)[0 if first_only else -1])
            self._store(index, float(path[period + 1]))
            probe.status |= stored

    def _edges(
        self, probe: _Probe, function: int, path: NDArray[np.float64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Rising and falling edges in each servo period (n,). The zero impulse of the encoder rises only."""
        if function & ZERO_IMPULSE:
            pulses = self._axis.hardware.index_pulses(path)
            return pulses, np.zeros_like(pulses)
        levels = self._axis.hardware.probes[probe.number].readings(path)
        levels[0] = probe.level
        probe.level = bool(levels[-1])
        return levels[1:] & ~levels[:-1], ~levels[1:] & levels[:-1]

    def _level(self, probe: _Probe, angle: float) -> bool:
        return self._axis.hardware.probes[probe.number].actuated(angle)

    def _store(self, index: int, angle: float) -> None:
        self._axis.dictionary[index].value = self._axis.scaling.position(angle)

    def _status(self) -> int:
        return sum(probe.status << 8 * probe.number for probe in self._probes)


def _check_sources(function: Value) -> None:
    """Bits 2 and 3, 10 and 11: the input (0) or the zero impulse (1); 2 is that of 60D0h, which is not there, 3 is reserved."""
    if any(int(function) >> shift & SOURCE not in (0, ZERO_IMPULSE) for shift in (0, 8)):
        raise SdoAbort(AbortCode.INVALID_VALUE)
