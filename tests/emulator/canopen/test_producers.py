"""SYNC and TIME producer (CiA 301, 7.2.5, 7.2.6, 7.5.2.5, 7.5.2.15)."""

from __future__ import annotations

import struct

import pytest
from canopen_bench import NODE, RESET_COMMUNICATION, START, STOP, Bench, Master

from drivetwin.emulator.canopen import AbortCode, SdoAbort

SYNC, TIME = 0x80, 0x100
PRODUCE = 0x4000_0000


def producer() -> Bench:
    """A node without event-driven PDOs, that may produce."""
    bench = Bench()
    bench.device.add_producers(bench._transmit)
    bench.boot()
    bench.write(0x1800, 1, 0x8000_0000 | 0x180 | NODE)
    return bench


def beats(bench: Bench, until: float, cob_id: int = SYNC) -> list[tuple[float, bytes]]:
    return [(time, data) for time, sent, data in bench.run_to(until) if sent == cob_id]


def test_sync_every_1006h_once_1005h_says_so() -> None:
    bench = producer()
    bench.write(0x1006, 0, 4000)
    assert beats(bench, 0.02) == []
    bench.write(0x1005, 0, PRODUCE | SYNC)
    assert beats(bench, 0.0305) == [(0.024, b""), (0.028, b"")]


def test_without_1006h_none_is_sent() -> None:
    bench = producer()
    bench.write(0x1005, 0, PRODUCE | SYNC)
    assert beats(bench, 0.1) == []
    bench.write(0x1006, 0, 50_000)
    assert beats(bench, 0.205) == [(0.15, b""), (0.2, b"")]
    bench.write(0x1006, 0, 0)
    assert beats(bench, 0.5) == []


def test_a_counter_goes_from_1_to_1019h() -> None:
    bench = producer()
    bench.write(0x1019, 0, 3)
    bench.write(0x1006, 0, 1000)
    bench.write(0x1005, 0, PRODUCE | SYNC)
    assert b"".join(data for _, data in beats(bench, 0.005)) == bytes((1, 2, 3, 1, 2))


def test_stopped_it_is_silent_and_the_counter_begins_again() -> None:
    bench = producer()
    bench.write(0x1019, 0, 10)
    bench.write(0x1006, 0, 1000)
    bench.write(0x1005, 0, PRODUCE | SYNC)
    assert len(beats(bench, 0.003)) == 3
    bench.nmt(STOP)
    assert beats(bench, 0.006) == []
    bench.nmt(START)
    assert b"".join(data for _, data in beats(bench, 0.008)) == bytes((1, 2))


def test_periods_do_not_drift() -> None:
    bench = producer()
    bench.write(0x1006, 0, 2500)
    bench.write(0x1005, 0, PRODUCE | SYNC)
    assert len(beats(bench, 1.0005)) == 400


def test_the_identifier_of_a_producer_is_fixed() -> None:
    bench = producer()
    bench.write(0x1005, 0, PRODUCE | SYNC)
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x1005, 0, PRODUCE | 0x90)
    assert refusal.value.code is AbortCode.DEVICE_STATE
    bench.write(0x1005, 0, 0x90)
    bench.write(0x1005, 0, PRODUCE | 0x90)
    assert bench.device.sync_cob_id == 0x90


def test_reset_communication_takes_it_back() -> None:
    bench = producer()
    bench.write(0x1006, 0, 1000)
    bench.write(0x1005, 0, PRODUCE | SYNC)
    bench.nmt(RESET_COMMUNICATION)
    assert beats(bench, 0.1) == []


def test_on_a_clock_that_only_sync_moves_a_drive_is_no_producer() -> None:
    for index, value in ((0x1005, PRODUCE | SYNC), (0x1012, PRODUCE | TIME)):
        with pytest.raises(SdoAbort) as refusal:
            Bench().boot().write(index, 0, value)
        assert refusal.value.code is AbortCode.INVALID_VALUE


def test_time_is_told_every_second_and_goes_on_from_what_was_told() -> None:
    bench = producer()
    Master(bench).time.transmit(1_000_000_000)
    bench.write(0x1012, 0, 0x8000_0000 | PRODUCE | TIME)
    told = [struct.unpack("<IH", data) for _, data in beats(bench, 2.0005, TIME)]
    days, seconds = divmod(1_000_000_000 - 441_763_200, 86_400)
    assert told == [(1000 * (seconds + 1), days), (1000 * (seconds + 2), days)]


def test_a_node_that_was_told_no_time_counts_from_its_power_on() -> None:
    bench = producer()
    bench.run_to(0.5)
    bench.write(0x1012, 0, PRODUCE | TIME)
    assert [data for _, data in beats(bench, 1.6, TIME)] == [struct.pack("<IH", 1500, 0)]


def test_the_identifier_of_a_time_producer_is_fixed() -> None:
    bench = producer()
    bench.write(0x1012, 0, PRODUCE | TIME)
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x1012, 0, PRODUCE | 0xA0)
    assert refusal.value.code is AbortCode.DEVICE_STATE
