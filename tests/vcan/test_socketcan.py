"""The same product on a real SocketCAN bus: what another process, canopen and can-utils see on vcan0."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path

import canopen
import pyarrow.parquet as pq
from canopen.profiles.p402 import BaseNode402
from processes import PATIENCE, drivetwin, emulator, start

from drivetwin.controller.dictionary import object_dictionary
from drivetwin.drive_profiles import load_profile

STAGE = ("--machine", "stage", "--clock", "sync")

MINUTES = 1200.0
"""Longest that an identification may take here [s]: a small kernel on a shared core needs more than two minutes for it."""


def test_identify_over_vcan_is_bit_for_bit_what_it_is_in_process(tmp_path: Path) -> None:
    with emulator(*STAGE, bus="vcan0") as bus:
        done = drivetwin("identify", *STAGE, "--bus", bus, "--out", tmp_path / "vcan", patience=MINUTES)
    assert (done.status, done.err) == (0, "")
    assert drivetwin("identify", *STAGE, "--out", tmp_path / "inproc", patience=MINUTES).status == 0
    names = sorted(path.name for path in (tmp_path / "vcan" / "recordings").iterdir())
    assert names
    for name in names:
        here, there = (pq.read_table(tmp_path / bus / "recordings" / name / "signals.parquet") for bus in ("inproc", "vcan"))
        assert here.equals(there), name
    slide = json.loads((tmp_path / "vcan" / "identified.json").read_text(encoding="utf-8"))["axes"]["slide"]
    assert "truth" not in slide


def test_a_missing_interface_is_one_line() -> None:
    done = drivetwin("identify", *STAGE, "--bus", "vcan7")
    assert done.status == 2
    assert done.err.count("\n") == 1
    assert "vcan7" in done.err


def test_canopen_enables_and_moves_a_drive_on_vcan() -> None:
    """Profile velocity, with positions in encoder increments, the units of a drive that nobody scaled."""
    with emulator("--machine", "arm", "--profile", "cia402-full", "--clock", "realtime", bus="vcan0"):
        network = canopen.Network()
        network.connect(interface="socketcan", channel="vcan0")
        try:
            node = BaseNode402(1, object_dictionary(load_profile("cia402-full")))
            network.add_node(node)
            node.sdo.RESPONSE_TIMEOUT = PATIENCE
            node.nmt.state = "RESET COMMUNICATION"
            await_true(lambda: node.nmt.state == "PRE-OPERATIONAL")
            node.setup_402_state_machine()
            node.nmt.state = "OPERATIONAL"
            node.op_mode = "PROFILED VELOCITY"
            node.state = "OPERATION ENABLED"
            start = node.sdo[0x6064].raw
            for index in (0x6083, 0x6084):
                node.sdo[index].raw = 1 << 26
            node.sdo[0x60FF].raw = 1 << 22
            await_true(lambda: node.sdo[0x6064].raw - start > 1 << 21)
            node.sdo[0x60FF].raw = 0
            await_true(lambda: abs(node.sdo[0x606C].raw) < 1 << 14)
            node.state = "SWITCH ON DISABLED"
        finally:
            network.disconnect()


def test_candump_and_cansend_see_a_canopen_node() -> None:
    """NMT reset by cansend; candump sees the boot-up message of each node."""
    with emulator("--machine", "scara", "--clock", "realtime", bus="vcan0"):
        before = listeners("vcan0")
        dump = subprocess.Popen(["candump", "-L", "-n", "4", "vcan0"], stdout=subprocess.PIPE, text=True)
        await_true(lambda: listeners("vcan0") > before)  # candump itself says nothing when it is listening
        subprocess.run(["cansend", "vcan0", "000#8200"], check=True)
        out, _ = dump.communicate(timeout=PATIENCE)
    assert [line.split()[2] for line in out.splitlines()] == ["000#8200", "701#00", "702#00", "703#00"]


def listeners(interface: str) -> int:
    """Sockets that receive every frame of an interface, as the kernel lists them."""
    listed = Path("/proc/net/can/rcvlist_all").read_text(encoding="ascii")
    return sum(line.split()[:1] == [interface] for line in listed.splitlines())


def await_true(condition) -> None:  # type: ignore[no-untyped-def]
    """Wait for a condition, for as long as a loaded machine may need."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_an_interface_that_is_down_for_a_moment_does_not_end_the_emulator() -> None:
    """`ip link set vcan0 down`, then up: as a master does that sets a bit rate. The emulator says so and goes on."""
    process = start("emulate", "--bus", "vcan0", "--machine", "stage", "--profile", "cia402-full", "--clock", "realtime")
    try:
        assert process.stdout is not None
        assert "vcan0" in process.stdout.readline()
        for change in ("down", "up"):
            subprocess.run(["ip", "link", "set", "vcan0", change], check=True)
            time.sleep(0.2)
        network = canopen.Network()
        network.connect(interface="socketcan", channel="vcan0")
        try:
            node = network.add_node(1, object_dictionary(load_profile("cia402-full")))
            node.sdo.RESPONSE_TIMEOUT = PATIENCE
            assert node.sdo[0x1000].raw & 0xFFFF == 402
        finally:
            network.disconnect()
    finally:
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert "is down: waiting until it is up again" in said
