"""Each drive has its own 1005h: which frame is SYNC is not one drive's to say for all."""

from __future__ import annotations

import can

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine


def test_a_drive_acts_at_its_own_sync_and_the_first_ones_moves_time() -> None:
    machine = load_machine("scara")
    sent: list[int] = []
    virtual = VirtualMachine(
        machine,
        load_profile("servoone"),
        read_effects(machine.effects_path),
        SyncClock(),
        0,
        lambda frame: sent.append(frame.arbitration_id),
    )
    virtual.power_on()
    for drive in virtual.drives:
        drive.dictionary[0x1800, 1].write(0x80000180 + drive.device.node_id)
        drive.dictionary[0x1800, 2].write(1)
        drive.dictionary[0x1800, 1].write(0x180 + drive.device.node_id)
    virtual.drives[1].dictionary[0x1005].write(0xA0)
    virtual.receive(can.Message(arbitration_id=0, data=b"\x01\x00", is_extended_id=False))
    sent.clear()
    virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))
    assert (sent, round(virtual.now(), 9)) == ([0x181, 0x183], 0.001)
    sent.clear()
    virtual.receive(can.Message(arbitration_id=0xA0, is_extended_id=False))
    assert (sent, round(virtual.now(), 9)) == ([0x182], 0.001)
