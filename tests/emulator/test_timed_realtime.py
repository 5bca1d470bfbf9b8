"""Bit timing on the wall clock, which the test moves: nothing is given before its bits are over, everything soon after."""

from __future__ import annotations

import can
import pytest
from timed_bench import SDO_ANSWER, SDO_REQUEST, SYNC, bits, frame

from drivetwin.bus.timing.wire import Transmission
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import RealtimeClock
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.timed_bus import RealtimeBus
from drivetwin.emulator.virtual_machine import VirtualMachine

BIT = 8e-6
"""At 125 kbit/s [s]."""

READ_DEVICE_TYPE = bytes.fromhex("4000100000000000")


class Wall:
    """A wall clock."""

    def __init__(self) -> None:
        self.time = 1000.0

    def __call__(self) -> float:
        return self.time


class Bench:
    def __init__(self) -> None:
        self.wall = Wall()
        self.seen: list[Transmission] = []
        self.received: list[can.Message] = []
        machine, profile = load_machine("stage"), load_profile("servoone")
        self.bus = RealtimeBus(
            125_000,
            lambda transmit: VirtualMachine(machine, profile, (), RealtimeClock(self.wall), 0, transmit),
            self.received.append,
            self.seen.append,
            self.wall,
        )
        self.bus.power_on()

    def at(self, time: float) -> list[int]:
        """Identifiers of what has come by then [s]."""
        self.wall.time = 1000.0 + time
        self.bus.poll()
        came = [message.arbitration_id for message in self.received]
        self.received.clear()
        return came


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    assert bench.at(0.02) == [0x701]
    return bench


def test_a_frame_is_given_when_it_is_whole(bench: Bench) -> None:
    """The request has its bits, then the answer its own; `wait` says when to look."""
    request = frame(SDO_REQUEST + 1, READ_DEVICE_TYPE)
    bench.bus.receive(request)
    whole = 0.02 + (bits(request) - 3) * BIT
    assert bench.at(whole - 1e-6) == []
    assert bench.bus.wait() == pytest.approx(1e-6, abs=1e-9)
    assert bench.at(whole + 1e-6) == []
    answered = whole + 3 * BIT + (bits(frame(SDO_ANSWER + 1, bytes.fromhex("4300100092010200"))) - 3) * BIT
    assert bench.at(answered - 1e-6) == []
    assert bench.at(answered + 1e-6) == [SDO_ANSWER + 1]
    assert bench.seen[-1].frame.data == bytes.fromhex("4300100092010200")
    assert bench.seen[-1].received == pytest.approx(answered, abs=1e-9)


def test_who_looks_late_does_not_delay_the_wire(bench: Bench) -> None:
    """The answer is handed in when the request was whole, not when somebody looked."""
    bench.bus.receive(frame(SDO_REQUEST + 1, READ_DEVICE_TYPE))
    assert bench.at(0.04) == [SDO_ANSWER + 1]
    request, answer = bench.seen[-2:]
    assert answer.handed_in == request.received
    assert answer.received < 0.024


def test_a_sync_moves_the_plant_when_it_is_whole(bench: Bench) -> None:
    """Behind a request. Until then the plant runs free on the wall clock, from then on it waits for SYNCs."""
    bench.bus.receive(frame(SDO_REQUEST + 1, READ_DEVICE_TYPE))
    bench.bus.receive(frame(SYNC))
    assert bench.at(0.0205) == []
    assert [sent.frame.identifier for sent in bench.seen] == [0x701]
    bench.at(0.025)
    assert [sent.frame.identifier for sent in bench.seen[1:]] == [SDO_REQUEST + 1, SYNC, SDO_ANSWER + 1]
    locked = bench.bus.virtual.now()
    bench.at(0.06)
    assert bench.bus.virtual.now() == locked


def test_a_heartbeat_is_told_though_nobody_asks(bench: Bench) -> None:
    bench.bus.receive(frame(SDO_REQUEST + 1, bytes.fromhex("2b1710000a000000")))
    assert bench.at(0.03) == [SDO_ANSWER + 1]
    came = [beat for step in range(1, 201) for beat in bench.at(0.03 + 1e-3 * step)]
    assert came.count(0x701) in (19, 20)
    beats = [sent.received for sent in bench.seen if sent.frame.identifier == 0x701][-10:]
    assert beats[-1] - beats[0] == pytest.approx(0.09, abs=2e-3)
