"""Bit timing: the reference controller works at 1 Mbit/s as on a bus that takes no time; `drivetwin emulate --bit-rate`."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
from processes import PATIENCE, start

from drivetwin.bus.channel import InprocBus, Peer, open_bus
from drivetwin.bus.timing.wire import Transmission
from drivetwin.controller.excitation import strokes
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import session_on
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.timed_bus import LockstepBus
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.recording.recording import Recording

READ_DEVICE_TYPE = can.Message(arbitration_id=0x601, is_extended_id=False, data=bytes.fromhex("4000100000000000"))

Transmit = Callable[[can.Message], None]


class Silent(Progress):
    def phase(self, name: str, seconds: float) -> None: ...

    def advance(self, seconds: float) -> None: ...


def virtual_scara(transmit: Transmit) -> VirtualMachine:
    machine = load_virtual_machine("scara")
    return VirtualMachine(machine, load_profile("servoone"), read_effects(machine.effects_path), SyncClock(), 0, transmit)


def untimed(transmit: Transmit) -> Peer:
    virtual = virtual_scara(transmit)
    virtual.power_on()
    return virtual


def recorded(connect: Callable[[Transmit], Peer], log: Path) -> Recording:
    """Brought up, homed, moved, recorded: rotate and stretch together at full speed."""
    bus, machine = InprocBus(connect), load_machine("scara")
    with session_on(bus, machine, load_profile("servoone"), Lockstep(), None, Silent(), log) as session:
        moving = {name: machine.axes[name] for name in ("rotate", "stretch")}
        session.go_to({name: 0.5 * sum(axis.travel) for name, axis in moving.items()})
        return session.capture("strokes", {name: strokes(axis, (1.0,), 0.001) for name, axis in moving.items()})


def test_three_axes_at_1_khz_record_on_1_mbit_s_what_they_do_without(tmp_path: Path) -> None:
    """Bit for bit: nothing that a cycle needs comes after its end."""
    seen: list[Transmission] = []
    built: list[LockstepBus] = []

    def timed_machine(transmit: Transmit) -> Peer:
        built.append(LockstepBus(1_000_000, virtual_scara, transmit, seen.append))
        built[0].power_on()
        return built[0]

    plain = recorded(untimed, tmp_path / "plain.log")
    timed = recorded(timed_machine, tmp_path / "timed.log")
    assert plain.columns.keys() == timed.columns.keys() == {"lift", "rotate", "stretch"}
    for axis, columns in plain.columns.items():
        for name, samples in columns.items():
            np.testing.assert_array_equal(timed.columns[axis][name], samples)
    assert built[0].late_frames == 0
    assert len(seen) > 10_000


def test_an_emulator_on_a_slow_wire_answers_and_says_what_does_not_fit(tmp_path: Path) -> None:
    """At 10 kbit/s a SYNC alone takes 5 ms; who sends one every 1 ms gets none to the drives in its cycle."""
    name = f"unix:{tmp_path / 'bus'}"
    process = start("emulate", "--bus", name, "--clock", "sync", "--bit-rate", "10k")
    try:
        assert process.stdout is not None
        assert name in process.stdout.readline()
        with open_bus(name) as bus:
            bus.send(READ_DEVICE_TYPE)
            answered(bus)
            for _ in range(10):
                bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
            bus.send(READ_DEVICE_TYPE)
            answered(bus)
    finally:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    assert re.search(r"080h came \d+ us after its cycle of 1 ms was over: the frames do not fit into it at 10 kbit/s", err)
    assert process.returncode == 0


def answered(bus: can.BusABC) -> None:
    while (message := bus.recv(PATIENCE)) is not None and message.arbitration_id != 0x581:
        pass
    assert message is not None
