"""A master and its drives come up in any order, as users of ros2_canopen meet it: STO low, a late slave, an early master.

The master is `canopen`'s BaseNode402; lely's AsyncMaster meets the same in test_lely.py.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import canopen
from canopen.profiles.p402 import BaseNode402
from processes import PATIENCE, emulator, tell

from drivetwin.controller.dictionary import object_dictionary
from drivetwin.drive_profiles import load_profile

PROFILE = "cia402-full"
DRIVES = ("--machine", "scara", "--profile", PROFILE)
SAFE_TORQUE_OFF = 0x5441
NODES = (1, 2, 3)


@contextmanager
def network_on(bus: str) -> Iterator[canopen.Network]:
    network = canopen.Network()
    network.connect(interface="remote", channel=bus, ignore_config=True)
    try:
        yield network
    finally:
        network.disconnect()


def add_drive(network: canopen.Network, node: int) -> BaseNode402:
    drive = BaseNode402(node, object_dictionary(load_profile(PROFILE)))
    drive.sdo.RESPONSE_TIMEOUT = PATIENCE
    network.add_node(drive)
    return drive


def until_state(drive: canopen.RemoteNode, wanted: int) -> None:
    until(lambda: state(drive) == wanted)


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def state(drive: canopen.RemoteNode) -> int:
    """Statusword, bits of the state (CiA 402-2, 6041h)."""
    return int(drive.sdo[0x6041].raw) & 0x6F


def enable(drive: canopen.RemoteNode) -> None:
    """The way to 'operation enabled', from wherever the drive is but a fault."""
    for controlword, wanted in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
        drive.sdo[0x6040].raw = controlword
        until_state(drive, wanted)


def test_sto_low_at_boot(tmp_path: Path) -> None:
    """The drive boots and is configured; it goes into a fault where torque is wanted, and is enabled once STO is high."""
    control = tmp_path / "control"
    with emulator(*DRIVES, "--control", control) as bus, network_on(bus) as network:
        tell(control, {"strike": {"fault": "sto", "node": 2}})
        drive = add_drive(network, 2)
        booted = threading.Event()
        drive.nmt.add_heartbeat_callback(lambda told: None if told else booted.set())
        drive.nmt.state = "RESET"
        assert booted.wait(PATIENCE)
        drive.nmt.state = "OPERATIONAL"
        assert state(drive) == 0x40
        for controlword in (0x06, 0x07, 0x0F):
            drive.sdo[0x6040].raw = controlword
        until(lambda: state(drive) == 0x08)
        assert drive.sdo[0x603F].raw == SAFE_TORQUE_OFF
        drive.sdo[0x6040].raw = 0x00
        drive.sdo[0x6040].raw = 0x80
        assert state(drive) == 0x08  # no reset helps while STO is low
        tell(control, {"end": {"fault": "sto", "node": 2}})
        drive.sdo[0x6040].raw = 0x00
        drive.sdo[0x6040].raw = 0x80
        until(lambda: state(drive) == 0x40)
        enable(drive)


def test_a_slave_that_appears_late(tmp_path: Path) -> None:
    """The others work meanwhile; its boot-up message says when it is there, and it knows nothing of before."""
    control = tmp_path / "control"
    with emulator(*DRIVES, "--control", control) as bus, network_on(bus) as network:
        tell(control, {"strike": {"fault": "node_dies", "node": 3}})
        drives = {node: add_drive(network, node) for node in NODES}
        late = drives[3]
        booted = threading.Event()
        late.nmt.add_heartbeat_callback(lambda told: None if told else booted.set())
        network.nmt.state = "OPERATIONAL"
        enable(drives[1])
        enable(drives[2])
        assert not booted.is_set()
        tell(control, {"strike": {"fault": "power_cycle", "node": 3, "off": 0.1}})
        assert booted.wait(PATIENCE)
        assert [state(drives[node]) for node in (1, 2)] == [0x27, 0x27]
        assert state(late) == 0x40
        enable(late)


def test_a_master_that_boots_before_the_drive(tmp_path: Path) -> None:
    """Its requests are lost, as on any bus without the node; with the boot-up message they are answered."""
    control = tmp_path / "control"
    with emulator("--machine", "arm", "--profile", PROFILE, "--control", control) as bus, network_on(bus) as network:
        tell(control, {"strike": {"fault": "node_dies", "node": 1}})
        drive = add_drive(network, 1)
        booted = threading.Event()
        drive.nmt.add_heartbeat_callback(lambda told: None if told else booted.set())
        request = bytes.fromhex("40 00 10 00 00 00 00 00")
        for _ in range(20):
            network.send_message(0x000, b"\x01\x01")
            network.send_message(0x601, request)
            network.sync.transmit()
        assert not booted.is_set()
        tell(control, {"strike": {"fault": "power_cycle", "node": 1, "off": 0.1}})
        assert booted.wait(PATIENCE)
        assert state(drive) == 0x40
        enable(drive)
