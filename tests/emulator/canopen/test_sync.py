"""SYNC counter, start value of a TPDO, synchronous window (CiA 301, 7.2.5, 7.5.2.7, 7.5.2.22, 7.5.2.37)."""

from __future__ import annotations

import struct

import pytest
from canopen_bench import NODE, STOP, Bench

from drivetwin.emulator.canopen import AbortCode, SdoAbort

TPDO, RPDO, EMCY = 0x180 + NODE, 0x200 + NODE, 0x80 + NODE
WRONG_LENGTH = (EMCY, bytes.fromhex("40 82 11 00 00 00 00 00"))


def tpdo(transmission_type: int, start: int, overflow: int = 10) -> Bench:
    bench = Bench().boot()
    bench.write(0x1019, 0, overflow)
    bench.write(0x1800, 1, 0x8000_0000 | TPDO)
    bench.write(0x1800, 6, start)
    bench.map_pdo(0x1800, (0x6064_0020,), transmission_type)
    bench.nmt(b"\x01")
    bench.take()
    return bench


def counters_that_sent(bench: Bench, counters: list[int | None]) -> list[int]:
    """Places in `counters` at which a frame went out."""
    places = []
    for place, counter in enumerate(counters):
        bench.device.sync(b"" if counter is None else bytes((counter,)))
        if bench.take():
            places.append(place)
    return places


def test_a_tpdo_waits_for_its_start_value() -> None:
    assert counters_that_sent(tpdo(1, start=3), [8, 9, 10, 1, 2, 3, 4, 5]) == [5, 6, 7]


def test_the_sync_of_the_start_value_is_the_first_of_n() -> None:
    assert counters_that_sent(tpdo(2, start=3), [1, 2, 3, 4, 5, 6, 7, 8]) == [3, 5, 7]


def test_start_value_0_does_not_look_at_the_counter() -> None:
    assert counters_that_sent(tpdo(1, start=0), [7, 8, 9]) == [0, 1, 2]


def test_without_1019h_the_start_value_is_ignored() -> None:
    assert counters_that_sent(tpdo(1, start=3, overflow=0), [None, None]) == [0, 1]


def test_the_start_value_is_awaited_again_after_a_stop() -> None:
    bench = tpdo(1, start=3)
    assert counters_that_sent(bench, [3, 4]) == [0, 1]
    bench.nmt(STOP)
    bench.nmt(b"\x01")
    assert counters_that_sent(bench, [5, 6, 3, 4]) == [2, 3]


def test_the_start_value_is_fixed_while_the_pdo_exists() -> None:
    bench = Bench().boot()
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x1800, 6, 1)
    assert refusal.value.code is AbortCode.DEVICE_STATE
    bench.write(0x1800, 1, 0x8000_0000 | TPDO)
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x1800, 6, 241)
    assert refusal.value.code is AbortCode.INVALID_VALUE


@pytest.mark.parametrize(("overflow", "right", "wrong"), [(0, None, 1), (10, 1, None)])
def test_a_wrong_sync_length_is_told_once_and_obeyed(overflow: int, right: int | None, wrong: int | None) -> None:
    bench = tpdo(1, start=0, overflow=overflow)
    frame = (TPDO, bytes(4))
    for counter, expected in (
        (right, [frame]),
        (wrong, [WRONG_LENGTH, frame]),
        (wrong, [frame]),
        (right, [(EMCY, bytes(8)), frame]),
        (right, [frame]),
    ):
        bench.device.sync(b"" if counter is None else bytes((counter,)))
        assert bench.take() == expected


@pytest.mark.parametrize(
    ("value", "cycle", "code"), [(1, 0, 0x06090030), (241, 0, 0x06090030), (10, 1000, 0x08000022)]
)
def test_overflow_values_that_are_refused(value: int, cycle: int, code: int) -> None:
    bench = Bench().boot()
    bench.write(0x1006, 0, cycle)
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x1019, 0, value)
    assert refusal.value.code == code


def windowed(profile: str, window: int) -> Bench:
    bench = Bench(profile).boot()
    bench.write(0x1006, 0, 2000)
    bench.write(0x1007, 0, window)
    bench.map_pdo(0x1400, (0x6040_0010,), 1)
    bench.nmt(b"\x01")
    bench.device.sync()
    return bench


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
@pytest.mark.parametrize(("late", "taken"), [(0.0, True), (2.5e-3, True), (2.6e-3, False)])
def test_a_synchronous_rpdo_after_the_window_is_discarded(profile: str, late: float, taken: bool) -> None:
    """Window 500 us; the time of a frame is known to a cycle, here 2 ms."""
    bench = windowed(profile, 500)
    bench.time += late
    bench.device.receive(RPDO, struct.pack("<H", 6))
    bench.device.sync()
    assert bench.od[0x6040].value == (6 if taken else 0)
    bench.device.receive(RPDO, struct.pack("<H", 7))
    bench.device.sync()
    assert bench.od[0x6040].value == 7


def test_without_a_window_any_time_is_right() -> None:
    bench = windowed("cia402-full", 0)
    bench.time += 10.0
    bench.device.receive(RPDO, struct.pack("<H", 6))
    bench.device.sync()
    assert bench.od[0x6040].value == 6


def test_a_window_written_in_operational_acts_at_once() -> None:
    bench = windowed("cia402-full", 0)
    bench.write(0x1007, 0, 500)
    bench.time += 10.0
    bench.device.receive(RPDO, struct.pack("<H", 6))
    bench.device.sync()
    assert bench.od[0x6040].value == 0
