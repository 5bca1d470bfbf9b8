"""What the virtual drive cannot be without: a drive with these objects and no others works in every mode that it has."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path

import can
import pytest

from drivetwin.drive_profiles import DriveProfile, available_profiles, load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.requirements import MANDATORY, required_objects
from drivetwin.emulator.canopen import AbortCode, SdoAbort
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

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
        assert (mode, drive.machine.state) == (mode, State.OPERATION_ENABLED)
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


# -- a user's EDS with the mandatory objects of CiA 301 and CiA 402-2, and those of one mode --------------------------

MANDATORY_ENTRIES = """
[1000]
ParameterName=Device type
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
[1001]
ParameterName=Error register
DataType=0x0005
AccessType=ro
[1018]
ParameterName=Identity object
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index supported
DataType=0x0005
AccessType=ro
DefaultValue=1
[1018sub1]
ParameterName=Vendor-ID
DataType=0x0007
AccessType=ro
DefaultValue=0x1234
[6040]
ParameterName=Controlword
DataType=0x0006
AccessType=rww
[6041]
ParameterName=Statusword
DataType=0x0006
AccessType=ro
[6060]
ParameterName=Modes of operation
DataType=0x0002
AccessType=rww
[6061]
ParameterName=Modes of operation display
DataType=0x0002
AccessType=ro
"""
CSP = """
[607A]
ParameterName=Target position
DataType=0x0004
AccessType=rww
[6064]
ParameterName=Position actual value
DataType=0x0004
AccessType=ro
"""
NODE = 1


def from_file(folder: Path, text: str, base: str = "cia402-full") -> DriveProfile:
    file = folder / "small.eds"
    file.write_text("[FileInfo]\nFileName=small.eds\n" + text)
    return profile_from_eds(file, load_profile(base))


def test_a_minimal_drive_moves(tmp_path: Path) -> None:
    """By SDO and SYNC alone, in increments: a ramp of half a motor turn, followed by the plant."""
    profile = from_file(tmp_path, MANDATORY_ENTRIES + CSP)
    assert (profile.modes, profile.streaming_mode) == ((8,), 8)
    assert {(entry.index, entry.subindex) for entry in profile.objects} == MANDATORY | {(0x607A, 0), (0x6064, 0)}
    virtual = VirtualMachine(load_machine("scara"), profile, (), SyncClock(), 0, lambda _: None)
    drive = virtual.drives[1]
    virtual.power_on()
    gear = 50.0
    start, position = float(virtual.plant.joint_positions()[1]) * gear, int(drive.dictionary[0x6064].read())
    drive.dictionary[0x607A].write(position)
    drive.dictionary[0x6060].write(8)
    for controlword in (SHUTDOWN, SWITCH_ON, ENABLE):
        run(virtual, drive, controlword)
    enabled = drive.machine.state
    assert enabled is State.OPERATION_ENABLED
    for step in range(1, 501):
        drive.dictionary[0x607A].write(position + round(step / 500 * 524288))
        run(virtual, drive, ENABLE, 1)
    run(virtual, drive, ENABLE, 400)
    assert float(virtual.plant.joint_positions()[1]) * gear - start == pytest.approx(pi, abs=1e-3)
    assert drive.dictionary[0x6064].read() == pytest.approx(position + 524288, abs=200)
    run(virtual, drive, QUICK_STOP, 50)
    assert drive.machine.state is State.SWITCH_ON_DISABLED


def test_what_a_minimal_drive_lacks_is_not_on_the_bus(tmp_path: Path) -> None:
    """Not by SDO, and it says nothing: no EMCY, no PDO, though the behaviour goes by 605Eh and 6085h."""
    sent: list[can.Message] = []
    profile = from_file(tmp_path, MANDATORY_ENTRIES + CSP)
    virtual = VirtualMachine(load_machine("stage"), profile, (), SyncClock(), 0, sent.append)
    drive = virtual.drives[0]
    virtual.power_on()
    for index in (0x1003, 0x1014, 0x1017, 0x1400, 0x1A00, 0x605E, 0x6072, 0x6085, 0x608F):
        with pytest.raises(SdoAbort) as refusal:
            drive.dictionary.find(index, 0)
        assert refusal.value.code == AbortCode.NO_SUCH_OBJECT
    drive.device.receive(0x000, bytes((0x01, NODE)))
    drive.device.receive(0x200 + NODE, bytes((SHUTDOWN, 0)))
    run(virtual, drive, SHUTDOWN)
    drive.fault(0x8611)
    run(virtual, drive, SHUTDOWN)
    assert drive.machine.state is State.FAULT
    assert [message.arbitration_id for message in sent] == [0x700 + NODE]  # the boot-up message


@pytest.mark.parametrize("name", ["servoone", "cia402-full", "dryve_d1"])
def test_a_file_has_the_modes_whose_objects_it_has(name: str, tmp_path: Path) -> None:
    homing = "[6098]\nParameterName=Homing method\nDataType=0x0002\nAccessType=rw\n"
    velocity = "[60FF]\nParameterName=Target velocity\nDataType=0x0004\nAccessType=rww\n"
    profile = from_file(tmp_path, MANDATORY_ENTRIES + homing + velocity, name)
    assert set(profile.modes) == {3, 6, 9} & set(load_profile(name).modes)
    assert profile.streaming_mode in profile.modes
    supported = next((entry.default for entry in profile.implicit if entry.index == 0x6502), None)
    assert supported is None


def test_a_file_without_any_mode_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="lacks objects that a drive which behaves as cia402-full needs: 607Ah;"):
        from_file(tmp_path, MANDATORY_ENTRIES)
