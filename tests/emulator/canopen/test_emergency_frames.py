"""EMCY, error register and history (CiA 301, 7.2.7, 7.5.2.2, 7.5.2.4)."""

import pytest
from canopen_bench import NODE, RESET_COMMUNICATION, RESET_NODE, STOP, Bench

EMCY = 0x80 + NODE


def test_frame_register_and_history() -> None:
    bench = Bench().boot()
    emergency = bench.device.emergency
    emergency.raise_error(0x8611, 0x20, b"\x34\x12\x00\x00\x01")
    assert bench.take() == [(EMCY, bytes.fromhex("11 86 21 34 12 00 00 01"))]
    emergency.raise_error(0x2310, 0x02)
    assert bench.take() == [(EMCY, bytes.fromhex("10 23 23 00 00 00 00 00"))]
    assert bench.sdo("40 01 10 00 00 00 00 00") == "4F 01 10 00 23 00 00 00"
    assert bench.sdo("40 03 10 00 00 00 00 00") == "4F 03 10 00 02 00 00 00"
    assert bench.sdo("40 03 10 01 00 00 00 00") == "43 03 10 01 10 23 00 00"
    assert bench.sdo("40 03 10 02 00 00 00 00") == "43 03 10 02 11 86 34 12"
    emergency.clear()
    assert bench.take() == [(EMCY, bytes(8))]
    assert bench.sdo("40 01 10 00 00 00 00 00") == "4F 01 10 00 00 00 00 00"
    assert bench.sdo("40 03 10 00 00 00 00 00") == "4F 03 10 00 02 00 00 00"


def test_clear_without_an_error_is_silent() -> None:
    bench = Bench().boot()
    bench.device.emergency.clear()
    bench.device.emergency.clear_error(0x8611)
    assert bench.take() == []


def test_one_error_gone_leaves_the_other() -> None:
    bench = Bench().boot()
    bench.device.emergency.raise_error(0x8611, 0x20)
    bench.device.emergency.raise_error(0x3210, 0x04)
    bench.take()
    bench.device.emergency.clear_error(0x3210)
    assert bench.take() == [(EMCY, bytes.fromhex("00 00 21 00 00 00 00 00"))]


def test_history_keeps_the_newest_and_is_cleared_by_0() -> None:
    bench = Bench().boot()
    for code in range(0x1001, 0x100B):
        bench.device.emergency.raise_error(code, 0)
    bench.take()
    assert bench.od[0x1003].read() == 8
    assert [bench.od[0x1003, sub].read() for sub in (1, 8)] == [0x100A, 0x1003]
    assert bench.sdo("2F 03 10 00 00 00 00 00") == "60 03 10 00 00 00 00 00"
    assert bench.od[0x1003].read() == 0


def test_no_frame_while_the_object_does_not_exist() -> None:
    bench = Bench().boot()
    bench.write(0x1014, 0, 0x8000_0000 | EMCY)
    bench.device.emergency.raise_error(0x1000, 0)
    assert bench.take() == []
    assert bench.od[0x1001].read() == 1


def test_the_identifier_can_be_moved() -> None:
    bench = Bench().boot()
    bench.write(0x1014, 0, 0x8000_0000 | EMCY)
    bench.write(0x1014, 0, 0xF0)
    bench.device.emergency.raise_error(0x1000, 0)
    assert bench.take()[0][0] == 0xF0


def test_reset_node_forgets_errors() -> None:
    bench = Bench().boot()
    bench.device.emergency.raise_error(0x1000, 0)
    bench.nmt(RESET_NODE)
    assert (bench.od[0x1001].read(), bench.od[0x1003].read()) == (0, 0)


def test_within_the_inhibit_time_the_next_ones_wait_in_order() -> None:
    bench = Bench().boot()
    bench.write(0x1015, 0, 50)
    for code in (0x1001, 0x1002, 0x1003):
        bench.device.emergency.raise_error(code, 0)
    assert [data[:2] for _, data in bench.take()] == [b"\x01\x10"]
    assert [(time, data[:2]) for time, _, data in bench.run_to(0.03)] == [(0.005, b"\x02\x10"), (0.010, b"\x03\x10")]
    bench.device.emergency.raise_error(0x1004, 0)
    assert [data[:2] for _, data in bench.take()] == [b"\x04\x10"]


def test_what_waits_is_not_sent_after_a_reset() -> None:
    bench = Bench().boot()
    bench.write(0x1015, 0, 50)
    bench.device.emergency.raise_error(0x1001, 0)
    bench.device.emergency.raise_error(0x1002, 0)
    bench.nmt(RESET_COMMUNICATION)
    bench.take()
    assert bench.run_to(0.1) == []


def test_what_waits_is_not_sent_when_stopped() -> None:
    bench = Bench().boot()
    bench.write(0x1015, 0, 50)
    bench.device.emergency.raise_error(0x1001, 0)
    bench.device.emergency.raise_error(0x1002, 0)
    bench.nmt(STOP)
    bench.take()
    assert bench.run_to(0.1) == []


@pytest.mark.parametrize(("profile", "depth"), [("cia402-full", 8), ("servoone", 1)])
def test_the_history_is_as_deep_as_the_drive_type_says(profile: str, depth: int) -> None:
    bench = Bench(profile).boot()
    for code in range(0x1001, 0x1010):
        bench.device.emergency.raise_error(code, 0)
    assert bench.od[0x1003].read() == depth
    assert bench.od[0x1003, depth].read() == 0x1010 - depth
