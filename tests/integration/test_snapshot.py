"""A drive's dictionary taken over the bus and loaded into another: `drivetwin snapshot`, `drivetwin emulate --snapshot`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import canopen
import pytest
from canopen.variable import Variable
from processes import PATIENCE, drivetwin, emulator

from drivetwin.controller.dictionary import object_dictionary
from drivetwin.drive_profiles import DriveProfile, available_profiles, load_profile
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.drive_profiles.snapshot import Reading, Snapshot, read_snapshot, write_snapshot
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.drive.drive import Drive
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.snapshot import COMMANDS, is_stored, load_snapshot
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

NODE = 1
CHANGES = {(0x6083, 0): 123_456, (0x6092, 1): 10_000, (0x605A, 0): 1, (0x1017, 0): 250, (0x1801, 1): 0x281, (0x607C, 0): -77}


@contextmanager
def master(bus: str, profile: DriveProfile) -> Iterator[canopen.RemoteNode]:
    network = canopen.Network()
    network.connect(interface="remote", channel=bus, ignore_config=True)
    node = network.add_node(NODE, object_dictionary(profile))
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    try:
        yield node
    finally:
        network.disconnect()


def variable(node: canopen.RemoteNode, index: int, subindex: int) -> Variable:
    found = node.sdo[index]
    return found if isinstance(found, Variable) else found[subindex]


def taken(bus: str, file: Path, *more: object) -> Snapshot:
    done = drivetwin("snapshot", "--bus", bus, "--node", NODE, "--out", file, *more)
    assert (done.status, done.err) == (0, "")
    return read_snapshot(file)


def stored(snapshot: Snapshot, drive: Drive) -> dict[tuple[int, int], Reading]:
    """What a drive keeps of what was read."""
    return {
        (reading.index, reading.subindex): reading
        for reading in snapshot.readings
        if is_stored(drive.dictionary[reading.index, reading.subindex])
    }


def virtual_drives(profile: DriveProfile) -> list[Drive]:
    return VirtualMachine(load_machine("stage"), profile, (), SyncClock(), 0, lambda _: None).drives


@pytest.mark.parametrize("name", available_profiles())
def test_what_was_read_of_one_drive_is_what_another_holds(name: str, tmp_path: Path) -> None:
    profile = load_profile(name)
    arguments = ("--machine", "stage", "--profile", name, "--clock", "sync")
    first, second = tmp_path / "first.json", tmp_path / "second.json"
    with emulator(*arguments) as bus:
        with master(bus, profile) as node:
            for (index, subindex), value in CHANGES.items():
                variable(node, index, subindex).raw = value
        before = taken(bus, first, "--profile", name)
    with emulator(*arguments, "--snapshot", first) as bus:
        after = taken(bus, second, "--profile", name)
    drive = virtual_drives(profile)[0]
    assert stored(before, drive) == stored(after, drive)
    values = {(reading.index, reading.subindex): reading.value for reading in after.readings}
    assert CHANGES.items() <= values.items()
    assert values[0x1018, 1] == profile.vendor_id
    assert values[0x1008, 0] == profile.device_name


def test_the_file_says_where_it_comes_from(tmp_path: Path) -> None:
    """Provenance keys, every object, and the abort code of what the drive refused."""
    file, eds = tmp_path / "axis.json", tmp_path / "drive.eds"
    eds.write_text(eds_text(load_profile("servoone"), eds.name))
    with emulator("--machine", "stage", "--eds", eds, "--clock", "sync") as bus:
        snapshot = taken(bus, file, "--eds", eds)
    payload = json.loads(file.read_text())
    assert (payload["schema"], payload["seed"], list(payload["inputs"])) == ("snapshot/1", 0, [str(eds)])
    assert (payload["profile"], payload["node"]) == ("drive", NODE)
    assert len(snapshot.readings) == len(load_profile("servoone").objects)
    refused = [entry for entry in payload["objects"] if "abort" in entry]
    assert {entry["abort"] for entry in refused} == {"08000024"}
    assert {entry["index"] for entry in refused} == {"1003"}


def test_a_node_that_is_not_there(tmp_path: Path) -> None:
    with emulator("--machine", "stage", "--clock", "sync") as bus:
        done = drivetwin("snapshot", "--bus", bus, "--node", 9, "--out", tmp_path / "none.json")
    assert done.status == 2
    assert "node 9 does not answer on" in done.err
    assert not list(tmp_path.iterdir())


def test_an_eds_that_lacks_what_the_drive_needs_stops_the_emulator(tmp_path: Path) -> None:
    eds = tmp_path / "small.eds"
    eds.write_text("[FileInfo]\nFileName=small.eds\n[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\n")
    done = drivetwin("emulate", "--machine", "stage", "--eds", eds)
    assert done.status == 2
    assert "small.eds lacks objects that a drive which behaves as servoone needs: 1001h, 1018h:00..01, 6040h," in done.err


# -- loading, without processes ----------------------------------------------------------------------------------------


def reading(index: int, subindex: int, data: bytes, kind: str) -> Reading:
    return Reading(index, subindex, "name", kind, "rw", data, None, None)


def test_commands_and_measured_values_are_the_virtual_drives_own(tmp_path: Path) -> None:
    drives = virtual_drives(load_profile("cia402-full"))
    assert {0x6040, 0x607A, 0x60FF} <= COMMANDS
    told = (
        reading(0x6040, 0, b"\x0f\x00", "U16"),
        reading(0x607A, 0, b"\x01\0\0\0", "I32"),
        reading(0x6064, 0, b"\x09\0\0\0", "I32"),
    )
    load_snapshot(drives, Snapshot("cia402-full", NODE, told), tmp_path)
    dictionary = drives[0].dictionary
    assert [dictionary[index].value for index in (0x6040, 0x607A, 0x6064)] == [0, 0, 0]


def test_stored_values_act(tmp_path: Path) -> None:
    """A loaded gain is the loop's, and survives a reset."""
    drive = virtual_drives(load_profile("cia402-full"))[0]
    load_snapshot([drive], Snapshot("x", NODE, (reading(0x60FB, 1, b"\0\0\x20\x41", "R32"),)), tmp_path)
    drive.dictionary.reset_application()
    assert drive.dictionary[0x60FB, 1].value == 10.0
    assert drive.axis.servo.parameters["position_gain"] == 10.0


@pytest.mark.parametrize(
    ("node", "entry", "complaint"),
    [
        (9, reading(0x6083, 0, bytes(4), "U32"), "is of node 9; this machine's drives are the nodes 1"),
        (NODE, reading(0x6083, 0, bytes(2), "U16"), "6083h:00 name is U16; this drive type has it as U32"),
        (NODE, reading(0x6083, 0, bytes(2), "U32"), "6083h:00 name: 2 bytes; U32 has 4"),
        (NODE, reading(0x6091, 1, bytes(4), "U32"), "6091h:01 name = 0 is outside what this drive type allows: 06090032h"),
        (NODE, reading(0x1600, 1, b"\x10\0\xff\x2f", "U32"), "the PDO mapping 1600h does not go with this drive type"),
    ],
)
def test_what_does_not_go_with_the_drive_is_refused(node: int, entry: Reading, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(UserError) as error:
        load_snapshot(virtual_drives(load_profile("cia402-full")), Snapshot("x", node, (entry,)), tmp_path / "axis.json")
    assert complaint in str(error.value)


def test_objects_that_the_drive_type_has_not_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    drives = virtual_drives(load_profile("cia402-full"))
    load_snapshot(drives, Snapshot("x", NODE, (reading(0x2FFF, 3, bytes(4), "U32"),)), tmp_path)
    assert "the drive type cia402-full has no 2FFFh:03; left out" in caplog.text


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda payload: payload.update(schema="recording/1"), "schema: Input should be 'snapshot/1'"),
        (lambda payload: payload.update(node=200), "node: Input should be less than or equal to 127"),
        (lambda payload: payload["objects"][0].update(data="xy"), "objects.0.data"),
        (lambda payload: payload.update(objects=[]), "objects: List should have at least 1 item"),
    ],
)
def test_a_wrong_file_is_named(change: Callable[[dict[str, Any]], None], complaint: str, tmp_path: Path) -> None:
    file = tmp_path / "axis.json"
    write_snapshot(file, Snapshot("x", NODE, (reading(0x6083, 0, bytes(4), "U32"),)), [])
    assert read_snapshot(file).readings == (reading(0x6083, 0, bytes(4), "U32"),)
    payload = json.loads(file.read_text())
    change(payload)
    file.write_text(json.dumps(payload))
    with pytest.raises(UserError, match=r"axis\.json: ") as error:
        read_snapshot(file)
    assert complaint in str(error.value)


def test_no_file_and_no_json(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="does not exist; expected a file of: drivetwin snapshot"):
        read_snapshot(tmp_path / "none.json")
    (tmp_path / "text.json").write_text("hello")
    with pytest.raises(UserError, match="cannot be read as a snapshot"):
        read_snapshot(tmp_path / "text.json")
