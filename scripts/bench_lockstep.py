"""What a benchmark measures: a controller on the virtual machine in process, and the plant alone."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import can
import mujoco
import numpy as np

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.excitation import excitation
from drivetwin.controller.link import Link
from drivetwin.controller.machine import Machine as KnownMachine
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import enable_streaming, home, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import Clock
from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.effects import PlacedEffect, read_effects
from drivetwin.emulator.machine import Machine
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import Plant
from drivetwin.emulator.virtual_machine import VirtualMachine

SECONDS = 4.0
PERIOD = 0.001
"""Communication cycle [s]."""


@dataclass(frozen=True)
class Bench:
    """A controller's link to a virtual machine, in process, and the machine, for its clock."""

    link: Link
    machine: VirtualMachine

    def __enter__(self) -> Bench:
        self.link.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.link.__exit__(None, None, None)

    def drives(self) -> list[DriveNode]:
        """Its drives, brought up."""
        drives = connect(self.link, load_machine("scara"), load_profile("servoone"))
        bring_up(self.link, drives, PERIOD)
        return drives


def scara_bench(clock: Clock) -> Bench:
    """The virtual SCARA with its own effects, powered on."""
    virtual = load_virtual_machine("scara")
    return virtual_bench(clock, virtual, read_effects(virtual.effects_path))


def virtual_bench(clock: Clock, virtual: Machine, effects: tuple[PlacedEffect, ...]) -> Bench:
    """A bench that has been powered on."""
    made: list[VirtualMachine] = []

    def connect_machine(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        made.append(VirtualMachine(virtual, load_profile("servoone"), effects, clock, 0, transmit))
        made[0].power_on()
        return made[0]

    return Bench(Link(InprocBus(connect_machine)), made[0])


def lockstep_bench(link: Link, known: KnownMachine) -> Callable[[], float]:
    """A homed and enabled machine; each call streams an exciting move on all axes and returns its speed."""
    drives = connect(link, known, load_profile("servoone"))
    cycle = Cycle(link, drives, Lockstep())
    bring_up(link, drives, cycle.period)
    cycle.start()
    home(cycle, drives)
    enable_streaming(cycle, drives)
    axes = known.axes.values()
    middles = [0.5 * (axis.travel[0] + axis.travel[1]) for axis in axes]
    starts = positions_now(drives)
    stream(
        cycle,
        drives,
        side_by_side([move(start, middle, 0.2, 0.5, cycle.period) for start, middle in zip(starts, middles, strict=True)]),
    )
    moves = side_by_side([excitation(axis, 0, cycle.period) for axis in axes])[: round(SECONDS / cycle.period)]

    def run() -> float:
        began = time.process_time()
        stream(cycle, drives, moves)
        return len(moves) * cycle.period / (time.process_time() - began)

    return run


def bare_plant() -> Callable[[], float]:
    """The plant alone, under a torque that keeps it moving; each call steps it and returns its speed."""
    machine = load_virtual_machine("scara")
    plant = Plant(machine, read_effects(machine.effects_path))
    steps = round(SECONDS / SERVO_PERIOD)
    torque = np.array([0.28, 0.06, 0.03])

    def run() -> float:
        plant.data.ctrl[:] = torque
        began = time.process_time()
        for _ in range(steps):
            mujoco.mj_step(plant.model, plant.data)
        return SECONDS / (time.process_time() - began)

    return run
