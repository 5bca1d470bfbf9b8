"""`canopen`'s own CiA 402 master in this process, the emulator in another: boot, enable, remap, move, fault, reset."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import canopen
import numpy as np
import pytest
from canopen.profiles.p402 import BaseNode402
from modes_402 import map_pdo, reset_node
from processes import PATIENCE, emulator

from drivetwin.controller.dictionary import object_dictionary
from drivetwin.drive_profiles import DriveProfile, load_profile

CYCLE = 0.004
"""Communication cycle, written to 1006h [s]: each SYNC moves the plant by so much."""

GEAR, MDEG_PER_TURN = 100, 360_000
"""The arm turns once in 100 turns of the motor; the master counts in mdeg and mdeg/s."""

SPEED, WAY = 20_000, 20_000
"""Of the moves [mdeg/s], [mdeg]."""

SET_POINT = {"servoone": (0x60C1, 1), "cia402-full": (0x607A, 0)}
STREAMING = {"servoone": "INTERPOLATED POSITION", "cia402-full": "CYCLIC SYNCHRONOUS POSITION"}
ENABLED = {"servoone": 0x1F, "cia402-full": 0x0F}
FOLLOWING_ERROR = 0x8611


@dataclass
class Bench:
    """A foreign master with one node, and what its TPDO 2 told at each SYNC: position [mdeg], velocity [mdeg/s]."""

    network: canopen.Network
    node: BaseNode402
    profile: DriveProfile
    told: list[tuple[int, int]] = field(default_factory=list)

    def one_sync(self) -> None:
        """Move the plant by one cycle and wait for what the drive tells."""
        seen = len(self.told)
        self.network.sync.transmit()
        self.until(lambda: len(self.told) > seen)

    @contextmanager
    def syncing(self) -> Iterator[None]:
        """SYNC every 2 ms beside what the master does; afterwards nothing of it is on its way any more.

        The emulator answers in order: once an SDO sent after the last SYNC is answered, its TPDOs have come.
        """
        over = threading.Event()

        def run() -> None:
            while not over.wait(0.002):
                self.network.sync.transmit()

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()
        assert self.node.sdo[0x1000].raw

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait for frames until a condition holds."""
        deadline = time.monotonic() + PATIENCE
        while not condition():
            self.node.tpdo[2].wait_for_reception(timeout=0.05)
            assert time.monotonic() < deadline, (self.node.state, hex(self.node.statusword), self.told[-3:])


@pytest.fixture(params=["servoone", "cia402-full"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    profile = load_profile(request.param)
    with emulator("--machine", "arm", "--profile", profile.name, "--clock", "sync") as bus:
        network = canopen.Network()
        network.connect(interface="remote", channel=bus, ignore_config=True)
        node = BaseNode402(1, object_dictionary(profile))
        for timeout in ("RESET_FAULT", "SWITCH_OP_MODE", "SWITCH_STATE_FINAL", "SWITCH_STATE_SINGLE", "CHECK_TPDO"):
            setattr(node, f"TIMEOUT_{timeout}", PATIENCE if timeout != "RESET_FAULT" else 0.4)
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        network.add_node(node)
        try:
            yield Bench(network, node, profile)
        finally:
            network.disconnect()


def boot(bench: Bench) -> None:
    """Reset, boot-up, scaling in mdeg, PDOs as this master wants them, operational."""
    node = bench.node
    reset_node(node)
    node.sdo[0x1006].raw = round(CYCLE * 1e6)
    node.sdo[0x6091][1].raw = GEAR
    node.sdo[0x6091][2].raw = 1
    node.sdo[0x6092][1].raw = MDEG_PER_TURN
    node.sdo[0x6092][2].raw = 1
    for index in (0x6083, 0x6084, 0x6085):
        node.sdo[index].raw = 10 * SPEED
    node.tpdo.read()
    node.rpdo.read()
    map_pdo(node.tpdo[1], [(0x6041, 0), (0x6061, 0)], 1)
    map_pdo(node.tpdo[2], [(0x6064, 0), (0x606C, 0)], 1)
    map_pdo(node.rpdo[1], [(0x6040, 0), (0x6060, 0)], 255)
    map_pdo(node.rpdo[2], [SET_POINT[bench.profile.name], (0x60B2, 0)], 1)
    node.setup_402_state_machine()
    node.tpdo[2].add_callback(lambda pdo: bench.told.append((pdo[0].raw, pdo[1].raw)))
    node.nmt.state = "OPERATIONAL"


def test_boot_enable_move_fault_and_reset(bench: Bench) -> None:
    boot(bench)
    velocity_mode(bench)
    with bench.syncing():
        bench.node.state = "SWITCH ON DISABLED"
        bench.node.op_mode = STREAMING[bench.profile.name]
        bench.node.rpdo[2][0].raw = bench.told[-1][0]  # csp follows 607Ah from the moment it is enabled
        bench.node.rpdo[2].transmit()
        bench.node.state = "OPERATION ENABLED"
    streamed(bench)
    with bench.syncing():
        fault_and_reset(bench)


def velocity_mode(bench: Bench) -> None:
    """Profile velocity: 606Ch reaches 60FFh, and 6064h moves by just that much a cycle."""
    node = bench.node
    with bench.syncing():
        node.op_mode = "PROFILED VELOCITY"
        node.state = "OPERATION ENABLED"
        assert node.op_mode == "PROFILED VELOCITY"
        node.sdo[0x60FF].raw = SPEED
        bench.until(lambda: node.statusword & 0x400 != 0 and bench.told[-1][1] > 0.9 * SPEED)
    cruise_from = len(bench.told)
    for _ in range(100):
        bench.one_sync()
    position, velocity = np.array(bench.told[cruise_from:]).T
    assert velocity.mean() == pytest.approx(SPEED, rel=0.02)
    assert (position[-1] - position[0]) / (99 * CYCLE) == pytest.approx(SPEED, rel=0.02)
    node.sdo[0x60FF].raw = 0
    for _ in range(100):
        bench.one_sync()
    assert abs(bench.told[-1][1]) < 0.02 * SPEED
    assert bench.told[-1][0] == pytest.approx(bench.told[-20][0], abs=20)


def streamed(bench: Bench) -> None:
    """A set-point a SYNC: 6064h follows it there and 606Ch is its slope."""
    node = bench.node
    bench.one_sync()
    at = node.rpdo[2][0].raw
    node.controlword = ENABLED[bench.profile.name]
    u = np.arange(1, 251) / 250
    path = at + WAY * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    begin = len(bench.told)
    for point in path:
        node.rpdo[2][0].raw = round(point)
        node.rpdo[2].transmit()
        bench.one_sync()
    for _ in range(50):
        bench.one_sync()
    position, velocity = np.array(bench.told[begin:]).T
    assert position[-1] == pytest.approx(at + WAY, abs=20)
    slope = np.gradient(path, CYCLE)
    lag = 2  # a set-point acts in the cycle that follows its SYNC, and is told at the end of it
    assert np.abs(velocity[lag : 250 + lag] - slope).max() < 0.15 * np.abs(slope).max()
    assert np.abs(position[lag : 250 + lag] - path).max() < 400


def fault_and_reset(bench: Bench) -> None:
    """A following error stops the drive with an EMCY; after a reset it holds again."""
    node = bench.node
    role = bench.profile.roles["following_error_limit"]
    limit = node.sdo[role.index]
    former = limit.raw
    limit.raw = 1
    node.rpdo[2][0].raw = node.rpdo[2][0].raw + 500
    node.rpdo[2].transmit()
    bench.until(lambda: node.state == "FAULT" and bool(node.emcy.active))
    assert [error.code for error in node.emcy.active] == [FOLLOWING_ERROR]
    limit.raw = former
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
    bench.until(lambda: not node.emcy.active)
    node.state = "SWITCH ON DISABLED"
    assert node.state == "SWITCH ON DISABLED"
