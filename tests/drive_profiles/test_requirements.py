"""What the virtual drive cannot be without: a drive with these objects and no others works in every mode that it has."""

from __future__ import annotations

from dataclasses import replace

import can
import pytest

from drive_profiles import DriveProfile, available_profiles, load_profile
from drive_profiles.requirements import required_objects
from emulator.clock import SyncClock
from emulator.drive.drive import Drive
from emulator.drive.state_machine import State
from emulator.machine import load_machine
from emulator.virtual_machine import VirtualMachine

SHUTDOWN, SWITCH_ON, ENABLE, START, HALT, QUICK_STOP, FAULT_RESET = 0x06, 0x07, 0x0F, 0x1F, 0x10F, 0x02, 0x80

PDO_MAPPINGS = (*range(0x1600, 0x1604), *range(0x1A00, 0x1A04))
"""Empty here: at power-on they carry objects that a drive can be without."""


def smallest(profile: DriveProfile) -> DriveProfile:
    """The drive type without everything that the behaviour does not need."""
    needed = required_objects(profile.modes)
    objects = tuple(
        replace(entry, default=0) if entry.subindex == 0 and entry.index in PDO_MAPPINGS else entry
        for entry in profile.objects
        if (entry.index, entry.subindex) in needed
    )
    assert {(entry.index, entry.subindex) for entry in objects} == needed
    kept = {name: role for name, role in profile.roles.items() if (role.index, role.subindex) in needed}
    return replace(profile, objects=objects, roles=kept)


def run(virtual: VirtualMachine, drive: Drive, controlword: int, cycles: int = 3) -> None:
    drive.dictionary[0x6040].write(controlword)
    for _ in range(cycles):
        virtual.receive(can.Message(arbitration_id=0x80, is_extended_id=False))


@pytest.mark.parametrize("name", available_profiles())
def test_a_drive_of_the_required_objects_works_in_every_mode(name: str) -> None:
    profile = smallest(load_profile(name))
    virtual = VirtualMachine(load_machine("stage"), profile, (), SyncClock(), 0, lambda _: None)
    drive = virtual.drives[0]
    virtual.power_on()
    for mode in sorted(drive._modes):  # those that are built
        drive.dictionary[0x6060].write(mode)
        for controlword in (SHUTDOWN, SWITCH_ON, ENABLE, START, ENABLE, HALT, ENABLE):
            run(virtual, drive, controlword)
        assert drive.machine.state is State.OPERATION_ENABLED, mode
        run(virtual, drive, QUICK_STOP, 20)
        run(virtual, drive, 0)
        assert drive.machine.state is State.SWITCH_ON_DISABLED
    drive.fault(0x8611)
    run(virtual, drive, 0)
    run(virtual, drive, FAULT_RESET)
    assert drive.machine.state is State.SWITCH_ON_DISABLED
    for variable in drive.dictionary:
        if variable.access.readable and variable.index != 0x1003:
            variable.encode()
    drive.device.receive(0x000, bytes((0x81, drive.device.node_id)))  # NMT: reset node
    run(virtual, drive, SHUTDOWN)


def test_modes_add_their_own_objects() -> None:
    assert (0x60C1, 1) in required_objects((7,)) - required_objects((8,))
    assert required_objects((3,)) <= required_objects((3, 6))
