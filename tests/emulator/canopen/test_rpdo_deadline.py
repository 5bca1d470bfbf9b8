"""Deadline monitoring of RPDOs by their event timer, EMCY 8250h (CiA 301, 7.5.2.35)."""

from __future__ import annotations

import pytest
from canopen_bench import NODE, STOP, Bench

RPDO, EMCY = 0x200 + NODE, 0x80 + NODE
MISSING = bytes.fromhex("50 82 11 01 00 00 00 00")


def watched(profile: str = "cia402-full", transmission_type: int = 255, timer: int = 5) -> Bench:
    bench = Bench(profile).boot()
    bench.write(0x1800, 1, 0x8000_0000 | 0x180 | NODE)
    bench.map_pdo(0x1400, (0x6040_0010,), transmission_type, event=timer)
    bench.nmt(b"\x01")
    return bench


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
@pytest.mark.parametrize("transmission_type", [1, 255])
def test_what_stays_away_is_told_once_and_when_it_is_back(profile: str, transmission_type: int) -> None:
    bench = watched(profile, transmission_type)
    bench.device.receive(RPDO, b"\x06\x00")
    assert bench.run_to(0.050) == [(0.005, EMCY, MISSING)]
    bench.device.receive(RPDO, b"\x06\x00")
    assert bench.take() == [(EMCY, bytes(8))]
    assert bench.run_to(0.100) == [(0.055, EMCY, MISSING)]


def test_before_the_first_frame_nothing_is_missed() -> None:
    assert watched().run_to(0.1) == []


def test_frames_in_time_are_not_missed() -> None:
    bench = watched()
    for k in range(20):
        bench.device.receive(RPDO, b"\x06\x00")
        assert bench.run_to((k + 1) * 4e-3) == []


def test_timer_0_watches_nothing() -> None:
    bench = watched(timer=0)
    bench.device.receive(RPDO, b"\x06\x00")
    assert bench.run_to(1.0) == []


@pytest.mark.parametrize("leave", [STOP, b"\x80", b"\x82"])
def test_outside_operational_nothing_is_missed(leave: bytes) -> None:
    bench = watched()
    bench.device.receive(RPDO, b"\x06\x00")
    bench.nmt(leave)
    bench.take()
    assert bench.run_to(0.1) == []


def test_a_late_frame_still_acts() -> None:
    bench = watched()
    bench.device.receive(RPDO, b"\x06\x00")
    bench.run_to(0.02)
    bench.device.receive(RPDO, b"\x07\x00")
    assert bench.od[0x6040].value == 7


def test_two_missing_rpdos_are_two_errors() -> None:
    bench = watched()
    bench.map_pdo(0x1401, (0x6071_0010,), 255, event=5)
    for cob_id in (RPDO, 0x300 + NODE):
        bench.device.receive(cob_id, b"\x06\x00")
    assert [data[3] for _, _, data in bench.run_to(0.01)] == [1, 2]
    bench.device.receive(RPDO, b"\x06\x00")
    assert bench.take() == [(EMCY, bytes.fromhex("00 00 11 00 00 00 00 00"))]
