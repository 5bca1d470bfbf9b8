"""Inhibit time of an RPDO: the least time between two frames that act (CiA 301, 7.5.2.35, :03)."""

from __future__ import annotations

import pytest
from canopen_bench import NODE, STOP, Bench

from drivetwin.emulator.canopen import AbortCode, SdoAbort

RPDO, VELOCITY = 0x200 + NODE, 0x60FF


def bench(transmission_type: int = 255, inhibit: int = 50) -> Bench:
    one = Bench().boot()
    one.map_pdo(0x1400, (VELOCITY << 16 | 32,), transmission_type, inhibit=inhibit)
    one.nmt(b"\x01")
    return one


def send(one: Bench, *values: int) -> None:
    for value in values:
        one.device.receive(RPDO, value.to_bytes(4, "little"))


def test_of_what_comes_too_early_the_newest_acts_when_the_time_is_over() -> None:
    one = bench()
    send(one, 1, 2, 3)
    assert one.od[VELOCITY].value == 1
    one.run_to(0.004)
    assert one.od[VELOCITY].value == 1
    one.run_to(0.005)
    assert one.od[VELOCITY].value == 3


def test_what_waited_begins_a_time_of_its_own() -> None:
    one = bench()
    send(one, 1, 2)
    one.run_to(0.006)
    send(one, 3)
    assert one.od[VELOCITY].value == 2
    one.run_to(0.010)
    assert one.od[VELOCITY].value == 3


def test_what_comes_later_acts_at_once() -> None:
    one = bench()
    send(one, 1)
    one.run_to(0.006)
    send(one, 2)
    assert one.od[VELOCITY].value == 2


def test_0_inhibits_nothing() -> None:
    one = bench(inhibit=0)
    send(one, 1, 2, 3)
    assert one.od[VELOCITY].value == 3


def test_a_synchronous_rpdo_is_not_inhibited() -> None:
    one = bench(transmission_type=1)
    for value in (1, 2):
        send(one, value)
        one.device.sync()
        assert one.od[VELOCITY].value == value


def test_what_waits_is_gone_with_operational() -> None:
    one = bench()
    send(one, 1, 2)
    one.nmt(STOP)
    one.nmt(b"\x01")
    one.run_to(0.1)
    assert one.od[VELOCITY].value == 1


def test_it_is_fixed_while_the_pdo_exists() -> None:
    with pytest.raises(SdoAbort) as refusal:
        bench().write(0x1400, 3, 10)
    assert refusal.value.code is AbortCode.DEVICE_STATE
