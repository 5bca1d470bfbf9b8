"""A controller and a virtual machine on an in-process bus, time moved by SYNC; the tests look at the machine from inside."""

from __future__ import annotations

from collections.abc import Callable

import can

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.link import SYNC_COB_ID, Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import Clock, SyncClock
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.virtual_machine import VirtualMachine


class VirtualBench:
    """`silent` holds node-IDs whose frames no longer arrive; `sent` the frames of the controller."""

    def __init__(self, machine: str = "stage", profile: str = "servoone", seed: int = 0, clock: Clock | None = None) -> None:
        self.silent: set[int] = set()
        self.sent: list[can.Message] = []
        self.profile = load_profile(profile)
        self.machine = load_machine(machine)
        clock = SyncClock() if clock is None else clock

        def connected(transmit: Callable[[can.Message], None]) -> VirtualMachine:
            virtual = load_virtual_machine(machine)
            effects = read_effects(virtual.effects_path)
            self.virtual = VirtualMachine(virtual, self.profile, effects, clock, seed, self._unless_silent(transmit))
            self.virtual.power_on()
            return self.virtual

        self.bus = InprocBus(connected)
        self.bus.shutdown()  # it holds nothing; said now, python-can does not warn at the end
        self.link = Link(self.bus)
        self.link.log = self._log
        self.drives = connect(self.link, self.machine, self.profile)
        self.cycle = Cycle(self.link, self.drives, Lockstep())
        self.before_sync: Callable[[], None] | None = None

    def up(self) -> VirtualBench:
        """Bring the drives up and start counting cycles."""
        bring_up(self.link, self.drives, self.cycle.period)
        self.cycle.start()
        return self

    def states(self) -> list[State]:
        """States of the virtual drives, from inside."""
        return [drive.machine.state for drive in self.virtual.drives]

    def speeds(self) -> list[float]:
        """True speeds of the joints [rad/s or m/s], from inside."""
        return [float(speed) for speed in self.virtual.plant.joint_velocities()]

    def _unless_silent(self, transmit: Callable[[can.Message], None]) -> Callable[[can.Message], None]:
        def send(message: can.Message) -> None:
            if message.arbitration_id & 0x7F not in self.silent:
                transmit(message)

        return send

    def _log(self, message: can.Message) -> None:
        if self.before_sync is not None and message.arbitration_id == SYNC_COB_ID:
            self.before_sync()
        self.sent.append(message)
