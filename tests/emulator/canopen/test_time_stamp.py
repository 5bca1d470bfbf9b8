"""TIME consumer (CiA 301, 7.2.6, 7.1.6, 1012h)."""

from __future__ import annotations

from datetime import datetime, timedelta

import pytest
from canopen_bench import NODE, RESET_COMMUNICATION, STOP, Bench, Master

from drivetwin.emulator.canopen import SdoAbort

NOON = bytes.fromhex("00 2E 93 02 01 00")
"""43,200,000 ms after midnight, one day after 1984-01-01."""


def test_time_goes_on_from_what_was_told() -> None:
    bench = Bench().boot()
    assert bench.device.time_stamp.time_of_day() is None
    bench.device.receive(0x100, NOON)
    bench.run_to(1.5)
    assert bench.device.time_stamp.time_of_day() == datetime(1984, 1, 2, 12, 0, 1, 500000)


def test_time_as_another_implementation_sends_it() -> None:
    bench = Bench().boot()
    Master(bench).time.transmit(1_000_000_000)
    told = bench.device.time_stamp.time_of_day()
    assert told == datetime(1970, 1, 1) + timedelta(seconds=1_000_000_000)


@pytest.mark.parametrize("data", [b"", NOON[:5], NOON + b"\x00"])
def test_another_length_is_not_a_time(data: bytes) -> None:
    bench = Bench().boot()
    bench.device.receive(0x100, data)
    assert bench.device.time_stamp.time_of_day() is None


def test_stopped_does_not_listen() -> None:
    bench = Bench().boot()
    bench.nmt(STOP)
    bench.device.receive(0x100, NOON)
    assert bench.device.time_stamp.time_of_day() is None


def test_1012h_moves_or_ends_it() -> None:
    bench = Bench().boot()
    bench.write(0x1012, 0, 0x8000_00A0)
    bench.device.receive(0x100, NOON)
    assert bench.device.time_stamp.time_of_day() is None
    bench.device.receive(0xA0, NOON)
    assert bench.device.time_stamp.time_of_day() is not None
    bench.write(0x1012, 0, 0x100)
    bench.device.receive(0x100, bytes(6))
    assert bench.device.time_stamp.time_of_day() == datetime(1984, 1, 2, 12)
    bench.nmt(RESET_COMMUNICATION)
    assert bench.od[0x1012].value == 0x8000_0100
    bench.device.receive(0x100, bytes(6))
    assert bench.device.time_stamp.time_of_day() == datetime(1984, 1, 1)


@pytest.mark.parametrize("value", [0xC000_0100, 0xA000_0100, 0x8000_0000 | 0x600 | NODE])
def test_a_producer_or_a_foreign_identifier_is_refused(value: int) -> None:
    with pytest.raises(SdoAbort):
        Bench().boot().write(0x1012, 0, value)


def test_servoone_has_no_1012h() -> None:
    bench = Bench("servoone").boot()
    bench.device.receive(0x100, NOON)
    assert bench.device.time_stamp.time_of_day() is None
