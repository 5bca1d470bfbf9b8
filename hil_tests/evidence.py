"""The evidence of a case for its judges: frames, the plant's truth, the drives' states, how the controller ended.

Times are simulated, from power on of a virtual machine; of real drives they are those of the wall clock since the case began.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.task import Task

Samples = NDArray[np.float64]


class Ending(StrEnum):
    """How the controller ended: by its exit status the first three, else by what the stand saw of it."""

    DONE = "done"
    STOPPED = "stopped"
    REFUSED = "refused"
    CRASHED = "crashed"
    KILLED = "killed"
    NEVER_STARTED = "never started"
    HANGS = "hangs"
    FLOODS = "floods"
    NEVER_ENDS = "never ends"
    BUS_LOST = "bus lost"


class BusFrame(NamedTuple):
    """A frame with its simulated time since power on [s], and who sent it."""

    time: float
    identifier: int
    data: bytes
    by_controller: bool
    requested: int | None
    """Data length that a remote frame asks for [byte]; None: a data frame."""
    heard: float
    """When the stand took it by the wall clock, since power on, or when its last bit was on the wire [s]; else 0."""


class StateChange(NamedTuple):
    """A drive's change of state, at simulated time [s]; `axis` is its name.

    `before` is None where a real drive told its state for the first time since it booted: it begins there.
    """

    time: float
    axis: str
    before: State | None
    after: State


class TorqueLimit(NamedTuple):
    """Torque or force that 6072h lets a real drive give from time [s] on, joint side [N·m or N]; None: nobody said it."""

    time: float
    axis: str
    torque: float | None


@dataclass(frozen=True)
class Struck:
    """A fault as it happened, at simulated time [s]; None: its condition never held."""

    text: str
    time: float | None


class BusLost(NamedTuple):
    """The stand heard no more of the bus from time [s] on, and why."""

    time: float
    reason: str


class Stall(NamedTuple):
    """The stand itself stood still for some seconds of the wall clock, until simulated time [s]."""

    time: float
    seconds: float


@dataclass(frozen=True)
class Run:
    """One start of the controller: how it ended, from when to when [s, simulated], and its last words."""

    ending: Ending
    status: int | None
    began: float
    ended: float
    last_words: str
    folder: Path


@dataclass(frozen=True)
class Configuration:
    """How a node was configured when it became operational, at simulated time [s], as its own dictionary says.

    `pdos` by name (`rpdo 1`): COB-ID as in the object, transmission type, mapping entries. Times in s, 0: off.
    """

    time: float
    pdos: Mapping[str, tuple[int, int, tuple[int, ...]]]
    heartbeat: float
    supervises: tuple[str, ...]
    """By what the drive notices that its master has gone."""
    limits_following_error: bool | None = None
    """Whether the drive faults by itself where the axis does not follow; None: its type has no such limit."""
    unknown_pdos: tuple[str, ...] = ()
    """PDOs of real drives that nobody wrote or read back on the bus."""


@dataclass(frozen=True)
class Truth:
    """The plant and the drives at the end of every cycle: `time` (n,) [s], all else (n, axes), joint side, SI.

    `demand` is the drive's position demand, meaningful where `positioning`; `zero` is where the drive's zero position truly
    lies; `offset` the torque offset (60B2h) in thousandths; `mode` is 6060h.
    """

    time: Samples
    position: Samples
    velocity: Samples
    torque: Samples
    demand: Samples
    zero: Samples
    offset: Samples
    enabled: NDArray[np.bool_]
    positioning: NDArray[np.bool_]
    mode: NDArray[np.int64]

    def between(self, start: float, end: float) -> slice:
        """The samples of start < time <= end [s]."""
        first, last = np.searchsorted(self.time, (start, end), side="right")
        return slice(int(first), int(last))

    def ends_before(self, time: float) -> bool:
        """Whether the last sample is earlier than a time [s]."""
        return bool(len(self.time)) and float(self.time[-1]) < time


@dataclass(frozen=True)
class Evidence:
    """Everything that was seen of one case."""

    bench: Bench
    task: Task
    axes: tuple[str, ...]
    nodes: tuple[int, ...]
    units: tuple[str, ...]
    """`m` or `rad` of each axis."""
    gears: tuple[float, ...]
    frames: tuple[BusFrame, ...]
    truth: Truth
    states: tuple[StateChange, ...]
    struck: tuple[Struck, ...]
    runs: tuple[Run, ...]
    configured: Mapping[str, Configuration]
    operational: frozenset[str]
    """Axes whose nodes were operational when the controller ended."""
    friction: Mapping[str, Mapping[str, float]]
    left_behind: tuple[str, ...]
    timed: bool
    """Whether frames have a time of their own, by wall clock or wire (`BusFrame.heard`)."""
    torque_limits: tuple[TorqueLimit, ...] = ()
    """Of real drives, at each start of their nodes and each change afterwards."""
    told: frozenset[str] | None = None
    """Axes whose real drives have told their state since they booted; None: drives are virtual, and asked from within."""
    homed: frozenset[str] | None = None
    """Axes whose real drives were seen to home since they booted; None: drives are virtual."""
    bus_lost: BusLost | None = None
    stalls: tuple[Stall, ...] = ()
    """Of the stand itself, in real time."""
    late: float = 0.0
    """One per cent of the time went into turns of the stand's own loop that lasted as long as this [s], in real time."""

    @property
    def fault_time(self) -> float | None:
        """When the first fault struck [s]; None where none did."""
        times = [struck.time for struck in self.struck if struck.time is not None]
        return min(times) if times else None

    @property
    def last_fault_time(self) -> float | None:
        """When the last fault struck [s]; None where none did."""
        times = [struck.time for struck in self.struck if struck.time is not None]
        return max(times) if times else None

    @property
    def end(self) -> float:
        """Simulated time at which the controller ended last [s]."""
        return self.runs[-1].ended if self.runs else 0.0

    @property
    def out(self) -> Path | None:
        """What the controller wrote at its last start."""
        return self.runs[-1].folder if self.runs else None

    @cached_property
    def syncs(self) -> Samples:
        """Times of the controller's SYNCs (n,) [s]."""
        return np.array([frame.time for frame in self.frames if frame.identifier == 0x80 and frame.by_controller])
