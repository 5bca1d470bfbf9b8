"""A master's time-outs hold: every state change from standstill is told by TPDO within 50 ms of simulated time.

The state machine is CiA 402-2's; the 50 ms are ours. Controlwords come as frames, statuswords are read from frames.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import can
import pytest
from drive_bench import PROFILE_VELOCITY, DriveBench

WITHIN = 0.050
"""Simulated seconds."""

OFF, READY, ON, RUN, QUICK, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08
SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, DISABLE_VOLTAGE, FAULT_RESET = 0x06, 0x07, 0x0F, 0x02, 0x00, 0x80
TO_READY, TO_ON, TO_RUN = (SHUTDOWN,), (SHUTDOWN, SWITCH_ON), (SHUTDOWN, SWITCH_ON, ENABLE)
TO_QUICK = (*TO_RUN, QUICK_STOP)


@dataclass(frozen=True)
class Change:
    """A transition of the FSA: how the drive gets to where it begins, the controlword, the state that is to be told."""

    name: str
    path: tuple[int, ...]
    controlword: int
    state: int
    quick_stop_option: int = 6


CHANGES = (
    Change("2", (), SHUTDOWN, READY),
    Change("3", TO_READY, SWITCH_ON, ON),
    Change("3 and 4", TO_READY, ENABLE, RUN),
    Change("4", TO_ON, ENABLE, RUN),
    Change("5", TO_RUN, SWITCH_ON, ON),
    Change("6", TO_ON, SHUTDOWN, READY),
    Change("7 by disable voltage", TO_READY, DISABLE_VOLTAGE, OFF),
    Change("7 by quick stop", TO_READY, QUICK_STOP, OFF),
    Change("8", TO_RUN, SHUTDOWN, READY),
    Change("9", TO_RUN, DISABLE_VOLTAGE, OFF),
    Change("10 by disable voltage", TO_ON, DISABLE_VOLTAGE, OFF),
    Change("10 by quick stop", TO_ON, QUICK_STOP, OFF),
    *(Change(f"11, 605Ah = {option}", TO_RUN, QUICK_STOP, QUICK, option) for option in (5, 6, 7, 8)),
    *(Change(f"11 and 12, 605Ah = {option}", TO_RUN, QUICK_STOP, OFF, option) for option in (0, 1, 2, 3, 4)),
    Change("12 by disable voltage", TO_QUICK, DISABLE_VOLTAGE, OFF),
    Change("16", TO_QUICK, ENABLE, RUN),
)


class Bus:
    """A drive on a bus, operational: controlwords in one of the ways of a master, statuswords out by TPDO 1."""

    def __init__(self, profile: str, machine: str, axis: str, way: str) -> None:
        self.bench = DriveBench(machine, axis, profile)
        self._write = {"SDO": self._by_sdo, "RPDO": self._by_rpdo, "synchronous RPDO": self._by_rpdo}[way]
        node = self.bench.configuration.node_id
        self._node = node
        if way == "synchronous RPDO":
            self._send(0x600 + node, "2F 00 14 02 01 000000")
        self._send(0, f"01 {node:02X}")
        self.bench.write(0x6060, PROFILE_VELOCITY)

    def settle(self) -> None:
        self.bench.sync(60)

    def controlword(self, word: int) -> None:
        self._write(word)

    def seconds_until(self, state: int, act: Callable[[], None]) -> float:
        """Simulated seconds from `act` to the first TPDO that tells the state; infinite where none does in 0.2 s."""
        begin, seen = self.bench.virtual.now(), len(self.bench.frames)
        act()
        for _ in range(200):
            self.bench.sync()
            for frame in self.bench.frames[seen:]:
                if frame.arbitration_id == 0x180 + self._node and _state(frame.data[0]) == state:
                    return frame.timestamp - begin
            seen = len(self.bench.frames)
        return float("inf")

    def _by_sdo(self, word: int) -> None:
        self._send(0x600 + self._node, f"2B 40 60 00 {word & 0xFF:02X} {word >> 8:02X} 0000")

    def _by_rpdo(self, word: int) -> None:
        self._send(0x200 + self._node, word.to_bytes(2, "little").hex())

    def _send(self, cob_id: int, data: str) -> None:
        self.bench.virtual.receive(can.Message(arbitration_id=cob_id, data=bytes.fromhex(data), is_extended_id=False))


def _state(low_byte: int) -> int:
    return low_byte & (0x4F if low_byte & 0x4F in (OFF, FAULT) else 0x6F)


@pytest.fixture(params=["servoone", "cia402-full"])
def profile(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=["SDO", "RPDO", "synchronous RPDO"])
def way(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=[("stage", "slide"), ("arm", "shoulder")], ids=["level", "under gravity"])
def bus(request: pytest.FixtureRequest, profile: str, way: str) -> Bus:
    machine, axis = request.param
    return Bus(profile, machine, axis, way)


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.name)
def test_a_state_change_is_told_in_time(bus: Bus, change: Change) -> None:
    bus.bench.write(0x605A, change.quick_stop_option)
    for word in change.path:
        bus.controlword(word)
        bus.settle()
    bus.settle()
    assert bus.seconds_until(change.state, lambda: bus.controlword(change.controlword)) <= WITHIN


@pytest.mark.parametrize("option", [0, 1, 2])
def test_a_fault_and_its_reset_are_told_in_time(bus: Bus, option: int) -> None:
    """Transitions 13 and 14 from operation enabled, then 15."""
    bus.bench.write(0x605E, option)
    for word in TO_RUN:
        bus.controlword(word)
        bus.settle()
    assert bus.seconds_until(FAULT, lambda: bus.bench.drive.fault(0x7121)) <= WITHIN
    assert bus.seconds_until(OFF, lambda: bus.controlword(FAULT_RESET)) <= WITHIN
