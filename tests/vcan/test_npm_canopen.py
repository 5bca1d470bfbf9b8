"""npm's `canopen`, a CANopen stack in JavaScript on its own SocketCAN channel, as master of one node on vcan0.

npm_canopen.js says what it does, a scenario a service; here stands what it has to see. The emulator has the clock `sync`.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import can
import pytest
from npm import seen
from processes import PATIENCE, emulator

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.canopen import ObjectDictionary
from drivetwin.emulator.canopen.time_stamp import TimeStamp

CYCLE = 0.001
"""Communication cycle of a drive whose 1006h is 0 [s]."""

TIME = 0x100
PRE_OPERATIONAL, OPERATIONAL, STOPPED, BOOT_UP = 127, 5, 4, 0


@pytest.fixture(scope="module")
def arm(eds_with_text: Path) -> Iterator[Path]:
    """One emulator for all scenarios: node 1, with the objects of the EDS that is yielded."""
    drives = ("--profile", "cia402-full", "--eds", eds_with_text, "--clock", "sync")
    with emulator("--machine", "arm", *drives, bus="vcan0"):
        yield eds_with_text


@pytest.fixture
def drive(arm: Path) -> Path:
    """Node 1 with its power-on values."""
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        bus.send(can.Message(arbitration_id=0, data=b"\x81\x01", is_extended_id=False))
        assert await_frame(bus, 0x701).data == b"\x00"
    return arm


def await_frame(bus: can.BusABC, identifier: int) -> can.Message:
    """The next frame of that identifier."""
    while True:
        frame = bus.recv(PATIENCE)
        assert frame is not None, hex(identifier)
        if frame.arbitration_id == identifier:
            return frame


def test_it_reads_the_eds(eds: Path) -> None:
    """All but formulae: it takes `$NODEID+80h` for 0, so that the script gives such objects their values."""
    profile = load_profile("cia402-full")
    assert seen("eds", eds) == {
        "objects": len({entry.index for entry in profile.objects}),
        "product": profile.device_name,
        "lss": True,
        "pdos": [4, 4],
        "identity": {"vendorId": 0, "productCode": 0x402, "revisionNumber": 0x10000, "serialNumber": 0},
        "target": ["Target position", "INTEGER32", "rw"],
        "formula": ["$NODEID+0x80", 0],
    }


def test_sdo_expedited_and_segmented(drive: Path) -> None:
    assert seen("sdo", drive) == {
        "type": 0x20192,
        "position": -123456,
        "time": 65535,
        "gain": 1.5,
        "name": "drivetwin CiA 402",
        "faithful": True,
    }


def test_sdo_block_transfer(drive: Path) -> None:
    """Of one segment, of a full block of 127, of one more, of three blocks; CRC both ways."""
    assert seen("block", drive) == {"lengths": [1, 7, 889, 890, 2000]}


def test_sdo_aborts(drive: Path) -> None:
    """The codes of CiA 301, table 'SDO abort codes'."""
    assert seen("aborts", drive) == {
        "object": "6020000",
        "subIndex": "6090011",
        "readOnly": "6010002",
        "long": "6070012",
        "short": "6070013",
        "high": "6090031",
        "value": "6090030",
        "state": "8000022",
        "blockRead": "6020000",
        "blockWrite": "6010002",
    }


def test_nmt_and_heartbeat(drive: Path) -> None:
    """Each command brings its state; a drive that falls silent is missed, and is back with its boot-up message."""
    assert seen("nmt", drive) == {"states": [OPERATIONAL, STOPPED, PRE_OPERATIONAL, BOOT_UP], "silent": 1, "bootUp": BOOT_UP}


def test_emergency(drive: Path) -> None:
    """8240h for a SYNC with a counter that nobody asked for, then 'error reset'; 1003h keeps it."""
    wrong_length = {"cobId": 0x81, "code": 0x8240, "register": 0x11, "text": "Unexpected SYNC data length"}
    reset = {"cobId": 0x81, "code": 0, "register": 0, "text": "Error reset"}
    assert seen("emcy", drive) == {"told": [wrong_length, reset], "history": 0x8240, "errorRegister": 0}


def test_sync_with_counter(drive: Path) -> None:
    """A heartbeat of 5 ms comes at the fifth SYNC of 1 ms, and no emergency where 1019h asks for a counter."""
    assert seen("sync", drive) == {"syncs": 5, "emergencies": 0}


def test_time(drive: Path) -> None:
    """The frame that it sends is the time of day that the drive's TIME consumer understands."""
    consumer = TimeStamp(ObjectDictionary.from_profile(load_profile("cia402-full"), 1), lambda: 0.0, lambda: None)
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        assert seen("time", drive) == {"timeCobId": 0x8000_0000 | TIME}
        consumer.handlers[TIME](bytes(await_frame(bus, TIME).data))
    assert consumer.time_of_day() == datetime(2024, 2, 29, 12, 34, 56, 789000)


def test_lss(drive: Path) -> None:
    """Select by address, inquire, node-ID, bit timing; fastscan finds nobody but a node without a node-ID."""
    assert seen("lss", drive) == {
        "nobody": None,
        "inquired": [0, 0x402, 0x10000, 1],
        "refused": 1,
        "bitTiming": "set",
        "noBitTiming": 1,
        "found": {"vendorId": 0, "productCode": 0x402, "revisionNumber": 0x10000, "serialNumber": 1},
        "stored": 1,  # store configuration is not supported: this emulator has no --store
        "answers": 0x20192,
    }


def test_profile_position_by_pdo(drive: Path) -> None:
    """Enabled and moved by RPDO 3 as CiA 402-2 maps it, in the time of the trapezoid; TPDO 3 tells it at each SYNC."""
    move = seen("motion", drive)
    assert move["states"] == [0x40, 0x21, 0x23, 0x27, 0x40]
    assert move["mode"] == 1
    assert move["moved"] == pytest.approx(move["way"], abs=1 << 12)  # 6067h, the position window
    duration = move["way"] / move["speed"] + move["speed"] / move["ramp"]
    assert move["cycles"] == pytest.approx(duration / CYCLE, abs=5)
