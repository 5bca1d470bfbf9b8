"""A virtual machine that is told tasks, with what truly happened to it, and trouble that strikes when its plant is so far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import can
import numpy as np
from numpy.typing import NDArray

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.machine import load_machine
from drivetwin.controller.outcome import Outcome
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.perform import Place, perform
from drivetwin.controller.tasks.file import Order
from drivetwin.controller.tasks.library import task_class
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

SYNC = 0x80

REST = {"lift": 5e-4, "rotate": 5e-3, "stretch": 5e-3, "slide": 5e-4}
"""A joint that is slower than this stands [m/s or rad/s]."""


@dataclass
class Trouble:
    """`strike` once `when` is true of the bench, and `undo` after `lasts` seconds."""

    when: Callable[[TaskBench], bool]
    strike: Callable[[VirtualMachine], None]
    lasts: float = float("inf")
    undo: Callable[[VirtualMachine], None] = lambda _machine: None
    struck: float | None = None
    undone: bool = False


@dataclass
class TaskBench:
    """The machine's end of the bus: passes frames on, notes the plant's truth after each SYNC."""

    machine: str = "scara"
    profile: str = "servoone"
    troubles: list[Trouble] = field(default_factory=list)
    frames: list[can.Message] = field(default_factory=list)
    sent: list[tuple[float, can.Message]] = field(default_factory=list)
    time: list[float] = field(default_factory=list)
    speeds: list[NDArray[np.float64]] = field(default_factory=list)
    positions: list[NDArray[np.float64]] = field(default_factory=list)
    states: list[tuple[State, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bus = InprocBus(self._connected)
        self.bus.shutdown()

    def told(self, task: str, out: Path, resume: bool = False, cycle: float = 0.001, **parameters: Any) -> Outcome:
        """Have the task done."""
        kind = task_class(task)
        known = load_machine(self.machine)
        order = Order(kind.model_validate(parameters), known, load_profile(self.profile), cycle, 0, resume)
        return perform(order, Place(self.bus, Lockstep(), None, out, None))

    @property
    def struck(self) -> float:
        """When the first trouble struck [s]."""
        return min(trouble.struck for trouble in self.troubles if trouble.struck is not None)

    def time_to_rest(self) -> float:
        """From the first trouble to when every axis stood for good [s]."""
        moving = (np.abs(np.array(self.speeds)) > self._rest_speeds).any(axis=1)
        return float(np.array(self.time)[moving][-1]) - self.struck

    def rests(self) -> bool:
        """Whether every axis stood at the last SYNC."""
        return bool((np.abs(self.speeds[-1]) <= self._rest_speeds).all())

    @property
    def _rest_speeds(self) -> NDArray[np.float64]:
        return np.array([REST[name] for name in self.virtual.machine.axes])

    def moving(self, axis: int, share: float = 0.3) -> bool:
        """Whether a streaming axis goes at this share of its full speed."""
        known = list(load_machine(self.machine).axes.values())[axis]
        drive = self.virtual.drives[axis]
        streams = int(drive.dictionary[0x6061].read()) in (7, 8)
        return streams and abs(float(self.virtual.plant.joint_velocities()[axis])) > share * known.max_speed

    # -- as the bus sees it -------------------------------------------------------------------------------------------

    def receive(self, message: can.Message) -> None:
        """A frame of the controller."""
        self.frames.append(message)
        self.sent.append((self.virtual.now(), message))
        self.virtual.receive(message)
        if message.arbitration_id == SYNC:
            self._note()
            self._look()

    def poll(self) -> None:
        """Let time pass."""
        self.virtual.poll()

    def wait(self) -> float | None:
        """As the machine says."""
        return self.virtual.wait()

    def _note(self) -> None:
        self.time.append(self.virtual.now())
        self.speeds.append(self.virtual.plant.joint_velocities().copy())
        self.positions.append(self.virtual.plant.joint_positions().copy())
        self.states.append(tuple(drive.machine.state for drive in self.virtual.drives))

    def _look(self) -> None:
        now = self.virtual.now()
        for trouble in self.troubles:
            if trouble.struck is None and trouble.when(self):
                trouble.struck = now
                trouble.strike(self.virtual)
            if trouble.struck is not None and not trouble.undone and now >= trouble.struck + trouble.lasts:
                trouble.undone = True
                trouble.undo(self.virtual)

    def _connected(self, transmit: Callable[[can.Message], None]) -> TaskBench:
        machine = load_virtual_machine(self.machine)
        effects = read_effects(machine.effects_path)
        self.virtual = VirtualMachine(machine, load_profile(self.profile), effects, SyncClock(), 0, transmit)
        self.virtual.power_on()
        return self
