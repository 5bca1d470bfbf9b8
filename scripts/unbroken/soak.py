"""A long life in lockstep: the SCARA moves, random faults strike it, and afterwards it always comes up, homes and moves again.

In each episode the controller streams, one or two faults of the library with random parameters strike and end, and the axes
are switched off and on. A controller may stop with its one line. Anything else that is raised is broken, and so is an axis that
does not come back, or stands elsewhere than it was told to.
"""

from __future__ import annotations

import gc
import hashlib
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from random import Random
from typing import Any

import can
import mujoco
import numpy as np
import psutil

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.link import Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import enable_streaming, home, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.faults.base import Fault, LastingFault
from drivetwin.emulator.faults.library import library, read_fault, required
from drivetwin.emulator.faults.parameter import ALL, NodeName, Number, Parameter, Whole, Word
from drivetwin.emulator.machine import load_machine as load_plant
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

MACHINE, PROFILE = "scara", "servoone"

SPEED, ACCELERATION = 0.3, 1.5
"""Of every axis, per second and per second squared of its own unit."""

LARGEST = 1e3
"""Of a fault's number: beyond it the plant itself is another machine."""

LATEST, LONGEST = 0.8, 1.0
"""When a fault strikes after the moves have begun, and how long it lasts, at most [s]."""

NEAR = 1e-3
"""What an axis may be off where it rests [rad or m]."""

UNSTABLE = "the simulation of the machine is unstable"
"""What the emulator says where a fault asks more of the plant than its steps can follow."""

FLAT = 4.0
"""What the memory of the process may grow by from the third quarter of the episodes to the last one [MB]: before them libraries
and caches are loaded. A controller and its samples that were kept would be more after a few episodes."""

JUDGED = 40
"""Episodes from which on a quarter of them is enough for its median."""


@dataclass(frozen=True)
class Soak:
    """What a soak came to; `memory` of the process, the median of each tenth of the episodes, and what it has `grown` by from
    the third quarter to the last [MB], None where they are too few; `digest` over every frame of the drives."""

    seed: int
    simulated: float
    episodes: int
    struck: Mapping[str, int]
    stopped: int
    unstable: int
    broken: tuple[str, ...]
    memory: tuple[float, ...]
    grown: float | None
    digest: str


class _Bench:
    """The virtual machine through all episodes, and the bus on which each episode's controller joins it."""

    def __init__(self, seed: int) -> None:
        self.frames = hashlib.sha256()
        self._seed = seed
        self.build()

    def build(self) -> None:
        """A new machine, as at first, and after one that cannot be simulated any further."""
        plant = load_plant(MACHINE)
        effects = read_effects(plant.effects_path)
        self._heard: list[can.Message] = []
        self.virtual = VirtualMachine(plant, load_profile(PROFILE), effects, SyncClock(), self._seed, self._transmit)
        self._told = self._heard.append
        self.virtual.power_on()

    def join(self) -> Link:
        """The link of a controller that has just been started."""

        def peer(transmit: Any) -> VirtualMachine:
            self._told = transmit
            return self.virtual

        return Link(InprocBus(peer))

    def end_all(self, faults: list[Fault]) -> None:
        """The bus goes on until what was still to strike has struck, and what lasts has ended."""
        try:
            for _ in range(round((LATEST + LONGEST) / 1e-3)):
                self.virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))
        except UserError as error:
            if UNSTABLE in str(error):
                raise _UnstableError from None
            raise
        for fault in faults:
            if isinstance(fault, LastingFault):
                fault.end(self.virtual)

    def switch_off_and_on(self) -> None:
        """As somebody at the machine does who gives up."""
        for axis in range(len(self.virtual.drives)):
            self.virtual.switch_off(axis)
        for axis in range(len(self.virtual.drives)):
            self.virtual.switch_on(axis)

    def _transmit(self, message: can.Message) -> None:
        self.frames.update(message.arbitration_id.to_bytes(4, "little") + bytes(message.data))
        self._told(message)


def soak(seconds: float, seed: int) -> Soak:
    """Episodes until `seconds` of simulated time have passed."""
    mujoco.set_mju_user_warning(lambda _message: None)  # a plant that a fault makes unstable is told by the emulator
    life = _Life(seed)
    while life.simulated() < seconds:
        life.episode()
    grown = growth(life.memory)
    if grown is not None and grown > FLAT:
        life.broken.append(f"the process's memory grew by {grown:.1f} MB where {FLAT:g} MB are allowed")
    return Soak(
        seed,
        life.simulated(),
        life.episodes,
        life.struck,
        life.stopped,
        life.unstable,
        tuple(life.broken),
        tenths(life.memory),
        grown,
        life.bench.frames.hexdigest(),
    )


def growth(memory: Sequence[float]) -> float | None:
    """From the third quarter of the episodes to the last, of medians; None for fewer than `JUDGED` episodes."""
    if len(memory) < JUDGED:
        return None
    quarter = len(memory) // 4
    return statistics.median(memory[-quarter:]) - statistics.median(memory[-2 * quarter : -quarter])


def tenths(memory: Sequence[float]) -> tuple[float, ...]:
    """The median of each tenth of the episodes, in their order."""
    edges = [len(memory) * tenth // 10 for tenth in range(11)]
    parts = [memory[begin:end] for begin, end in pairwise(edges)]
    return tuple(round(statistics.median(part), 1) for part in parts if part)


class _UnstableError(Exception):
    """A fault made a plant of the machine that steps of the servo period cannot follow, and the emulator said so."""


class _Life:
    """The episodes of one seed, and what they came to."""

    def __init__(self, seed: int) -> None:
        self.bench = _Bench(seed)
        self.struck: dict[str, int] = {}
        self.broken: list[str] = []
        self.memory: list[float] = []
        self.episodes = self.stopped = self.unstable = 0
        self._before = 0.0
        self._dice = Random(f"soak {seed}")

    def simulated(self) -> float:
        """Seconds that all machines of this life have lived."""
        return self._before + self.bench.virtual.now()

    def episode(self) -> None:
        """One controller, what strikes it, and whether all is whole at the next start."""
        self.episodes += 1
        faults = [_drawn(self._dice, self.bench.virtual) for _ in range(self._dice.choice((1, 1, 2)))]
        for fault in faults:
            self.struck[fault.name] = self.struck.get(fault.name, 0) + 1
        try:
            with self.bench.join() as link:
                cycle, drives = _up(link)
                _check_moves(cycle, drives, self._dice)
                self.stopped += _stops(self.bench, cycle, drives, faults, self._dice)
            self.bench.end_all(faults)
            self.bench.switch_off_and_on()
        except _UnstableError:
            self.unstable += 1
            self._rebuild()
        except Exception as error:  # noqa: BLE001  # whatever it is, it is what a soak looks for
            self.broken.append(f"episode {self.episodes}, {faults}: {type(error).__name__}: {error}")
            self._rebuild()
        gc.collect()
        self.memory.append(_memory())

    def _rebuild(self) -> None:
        self._before += self.bench.virtual.now()
        self.bench.build()


def _stops(bench: _Bench, cycle: Cycle, drives: list[DriveNode], faults: list[Fault], dice: Random) -> bool:
    """A controller at work while faults strike and end; whether it stopped with its one line."""
    now, alarms = bench.virtual.now(), bench.virtual.alarms
    for fault in faults:
        start = now + dice.uniform(0.0, LATEST)
        alarms.add(_at(fault.strike, bench.virtual)).set(start)
        if isinstance(fault, LastingFault):
            alarms.add(_at(fault.end, bench.virtual)).set(start + dice.uniform(0.01, LONGEST))
    try:
        _move(cycle, drives, dice)
        _move(cycle, drives, dice)
    except UserError as error:
        if UNSTABLE in str(error):
            raise _UnstableError from None
        return True
    return False


def _at(happens: Callable[[VirtualMachine], None], virtual: VirtualMachine) -> Callable[[float], None]:
    """What an alarm does."""
    return lambda _now: happens(virtual)


def _check_moves(cycle: Cycle, drives: list[DriveNode], dice: Random) -> None:
    """Raises AssertionError where an axis is not where it was told to go."""
    _move(cycle, drives, dice)
    where, asked = np.array([drive.position * drive.unit for drive in drives]), positions_now(drives)
    if not np.allclose(where, asked, atol=NEAR):
        raise AssertionError(f"the axes stand at {where}, and were told {asked}")


def _up(link: Link) -> tuple[Cycle, list[DriveNode]]:
    """Drives configured, homed and enabled."""
    drives = connect(link, load_machine(MACHINE), load_profile(PROFILE))
    cycle = Cycle(link, drives, Lockstep())
    bring_up(link, drives, cycle.period)
    cycle.start()
    home(cycle, drives)
    enable_streaming(cycle, drives)
    return cycle, drives


def _move(cycle: Cycle, drives: list[DriveNode], dice: Random) -> None:
    """All axes at once to somewhere in the middle half of their travel, and a rest there."""
    ways = []
    for drive, at in zip(drives, positions_now(drives), strict=True):
        low, high = drive.axis.travel
        to = low + (high - low) * dice.uniform(0.25, 0.75)
        ways.append(move(float(at), to, SPEED, ACCELERATION, cycle.period))
    rest = 200
    together = side_by_side(ways)
    stream(cycle, drives, np.concatenate([together, np.repeat(together[-1:], rest, axis=0)]))


def _drawn(dice: Random, virtual: VirtualMachine) -> Fault:
    """A fault of the library with random parameters, on one axis or all."""
    name = dice.choice(sorted(library()))
    kind = library()[name]
    needed = required(kind)
    while True:
        told = {one.name: _value(one, dice, virtual) for one in kind.parameters if one.name in needed or dice.random() < 0.5}
        try:
            fault = read_fault({"fault": name, **told})
            fault.axes(virtual)
        except (UserError, ValueError):  # parameters that do not go together
            continue
        assert {field.name for field in fields(fault)} >= set(told)
        return fault


def _value(parameter: Parameter, dice: Random, virtual: VirtualMachine) -> object:
    match parameter:
        case NodeName():
            return dice.choice([*virtual.machine.axes, ALL])
        case Word():
            return dice.choice(parameter.words)
        case Whole():
            return dice.randint(parameter.low, min(parameter.high, parameter.low + 2**16))
        case Number():
            return max(parameter.low, min(parameter.high, LARGEST) * 10.0 ** dice.uniform(-4.0, 0.0))
    raise TypeError(f"no random value of a {type(parameter).__name__}")


def _memory() -> float:
    """Of this process, resident [MB]."""
    return float(psutil.Process().memory_info().rss / 1e6)
