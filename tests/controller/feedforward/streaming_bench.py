"""A session of the reference controller on virtual drives, streaming, whose plant the tests look at from inside."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import can

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import Session, Streaming, session_on
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

EACH_MILLISECOND = Streaming()


@dataclass(frozen=True)
class StreamingBench:
    """The controller's side and the machine's."""

    session: Session
    virtual: VirtualMachine

    def joint_torque(self, axis: int) -> float:
        """Torque that the motor of an axis truly gives now, joint side [N·m or N]."""
        drive = self.session.drives[axis]
        return float(self.virtual.drives[axis].axis.servo.state["torque"]) * drive.axis.gear_ratio


@contextmanager
def streaming(
    machine: str,
    profile: str,
    effects: tuple[PlacedEffect, ...],
    log: Path,
    how: Streaming = EACH_MILLISECOND,
) -> Iterator[StreamingBench]:
    """The machine homed, at rest and streaming, its truth being `effects`; the bus is logged to `log`."""
    built: list[VirtualMachine] = []

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        virtual = VirtualMachine(load_virtual_machine(machine), load_profile(profile), effects, SyncClock(), 0, transmit)
        virtual.power_on()
        built.append(virtual)
        return virtual

    bus = InprocBus(connect)
    with session_on(bus, load_machine(machine), load_profile(profile), Lockstep(), None, Progress(), log, how) as session:
        yield StreamingBench(session, built[0])
