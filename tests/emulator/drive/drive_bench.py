"""A virtual machine in lockstep whose drives a test commands by their dictionaries, as an SDO does, and by SYNC."""

from __future__ import annotations

from math import pi

import can
import numpy as np
from numpy.typing import NDArray

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.effects import PlacedEffect, read_effects
from drivetwin.emulator.machine import Machine, load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

CYCLE = 0.001
SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, DISABLE_VOLTAGE, FAULT_RESET, HALT = 0x06, 0x07, 0x0F, 0x02, 0x00, 0x80, 0x10F
START = 0x1F
"""Enable operation with bit 4: start homing, enable interpolation."""
PROFILE_VELOCITY, HOMING, INTERPOLATED, CYCLIC = 3, 6, 7, 8


class DriveBench:
    """One axis of a machine under test; the others are on the bus too and stay as they powered on."""

    def __init__(
        self,
        machine: str | Machine = "stage",
        axis: str = "slide",
        profile: str = "cia402-full",
        effects: tuple[PlacedEffect, ...] | None = None,
        seed: int = 0,
    ) -> None:
        self.machine = load_machine(machine) if isinstance(machine, str) else machine
        if effects is None:
            effects = read_effects(self.machine.effects_path)
        self.frames: list[can.Message] = []
        self.virtual = VirtualMachine(self.machine, load_profile(profile), effects, SyncClock(), seed, self.frames.append)
        self.index = list(self.machine.axes).index(axis)
        self.configuration = self.machine.axes[axis]
        self.drive: Drive = self.virtual.drives[self.index]
        self.virtual.power_on()

    # -- the master's side --------------------------------------------------------------------------------------------

    def write(self, index: int, value: float, subindex: int = 0) -> None:
        """As by SDO: checked, then stored."""
        self.drive.dictionary.find(index, subindex).write(value)

    def read(self, index: int, subindex: int = 0) -> float:
        """What an SDO upload gives."""
        value = self.drive.dictionary.find(index, subindex).read()
        assert not isinstance(value, str)
        return value

    def sync(self, cycles: int = 1) -> None:
        """SYNC frames."""
        for _ in range(cycles):
            self.virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))

    def command(self, *controlwords: int) -> None:
        """Controlwords, a cycle each."""
        for controlword in controlwords:
            self.write(0x6040, controlword)
            self.sync()

    def enable(self, mode: int) -> None:
        """Choose the mode and enable operation."""
        self.write(0x6060, mode)
        self.command(SHUTDOWN, SWITCH_ON, ENABLE)
        assert self.state is State.OPERATION_ENABLED

    def record(self, cycles: int, *objects: int) -> NDArray[np.float64]:
        """Objects read after each of `cycles` SYNCs: (cycles, objects)."""
        rows = []
        for _ in range(cycles):
            self.sync()
            rows.append([self.read(index) for index in objects])
        return np.array(rows)

    @property
    def state(self) -> State:
        """State by the statusword, as a master sees it."""
        word = int(self.read(0x6041))
        return State(word & (0x4F if word & 0x4F in (0x00, 0x40, 0x0F, 0x08) else 0x6F))

    def emergencies(self) -> list[int]:
        """EMCY codes so far."""
        cob_id = 0x80 + self.configuration.node_id
        return [int.from_bytes(frame.data[:2], "little") for frame in self.frames if frame.arbitration_id == cob_id]

    # -- the truth ----------------------------------------------------------------------------------------------------

    @property
    def joint(self) -> float:
        """True joint position [rad or m]."""
        return float(self.virtual.plant.joint_positions()[self.index])

    @property
    def joint_velocity(self) -> float:
        """True joint velocity [rad/s or m/s]."""
        return float(self.virtual.plant.joint_velocities()[self.index])

    @property
    def motor(self) -> float:
        """True motor angle [rad]."""
        return self.joint * self.configuration.gear_ratio

    def units(self, radians: float) -> int:
        """Encoder increments of a motor angle, speed or acceleration: the units that a drive has until it is scaled."""
        return round(radians * self.configuration.encoder.increments_per_revolution / (2.0 * pi))
